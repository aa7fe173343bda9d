#pragma once

#include <memory>
#include <string>
#include <vector>

#include "admission/idle_calls.hpp"
#include "grpc/reflection/v1/reflection.pb.h"
#include "rpc/raw_service.hpp"

namespace scanloc::server {

/// Server reflection, as grpc.reflection.v1 and v1alpha. Written here because gRPC's own holds a
/// thread for every open stream, for as long as its client likes, and the server up when it stops.
class ReflectionService final : public RawService {
 public:
  /// Streams at once; beyond: ResourceExhausted.
  static constexpr int kMaxStreams = 16;

  /// The full names of the services that it lists, besides itself.
  explicit ReflectionService(std::vector<std::string> services);

  /// Ends every stream.
  void Drain();

 private:
  class Stream;

  [[nodiscard]] grpc::reflection::v1::ServerReflectionResponse Answer(
      const grpc::reflection::v1::ServerReflectionRequest& request) const;

  const std::vector<std::string> services_;
  IdleCalls streams_;  // all streams: answers are made at once
};

}  // namespace scanloc::server
