#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <map>
#include <string>
#include <utility>

namespace scanloc::server {

/// A service whose methods, unary ones included, are streams of bytes to the server: on the wire
/// that is the same, but nothing of a request is received before the method asks for it. gRPC's own
/// unary methods are called with the whole request in memory, whoever sent it.
class RawService {
 public:
  using Reactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;
  using Begin = std::function<Reactor*(grpc::CallbackServerContext*)>;
  using Methods = std::map<std::string, Begin>;  ///< by path: /package.Service/Method

  RawService() = default;
  RawService(const RawService&) = delete;
  RawService& operator=(const RawService&) = delete;

  [[nodiscard]] const Methods& methods() const { return methods_; }

 protected:
  ~RawService() = default;

  void Serve(const std::string& path, Begin begin) { methods_.emplace(path, std::move(begin)); }

 private:
  Methods methods_;
};

}  // namespace scanloc::server
