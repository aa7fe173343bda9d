#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "metrics.hpp"
#include "scanloc/server/worker_pool.hpp"
#include "scanloc/v1/localization.pb.h"

namespace scanloc::server {

/// What answers the requests of one stream, one after the other, on whatever worker is free.
/// Dropped when the stream ends.
using StreamAnswerer = std::function<absl::StatusOr<v1::LocalizeStreamResponse>(
    const v1::LocalizeStreamRequest& request, std::int64_t arrived_ns, int worker)>;

/// One stream, as the service sees it.
struct StreamHandler {
  std::string client;  ///< whose turn it takes
  StreamAnswerer answer;
  /// Once, with the status that the robot gets; from any thread.
  std::function<void(const absl::Status&)> ended;
  Metrics* metrics = nullptr;
};

/// The open streams of a server, at most so many. Of each stream one request at a time is read,
/// answered and its answer written, so that a robot that sends faster than it is answered is held
/// up by the flow control of its own connection. Thread-safe.
class RobotStreams {
 public:
  using Reactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;

  /// The pool must outlive the streams. max_per_client: 0 is as many as there may be.
  RobotStreams(WorkerPool& workers, int max_streams, int max_per_client);
  ~RobotStreams();

  /// Begins a stream; one too many ends with ResourceExhausted at once, and one that is not
  /// admitted with that status.
  [[nodiscard]] Reactor* Open(StreamHandler handler, absl::Status admitted);

  /// Ends every stream, with Unavailable: at once those that wait for their robot, the others after
  /// the answer under way. Further ones end so, too.
  void Drain();

  [[nodiscard]] int num_open() const;

 private:
  class Stream;
  struct Registry;
  std::shared_ptr<Registry> registry_;  // streams that end after the server hold it
};

}  // namespace scanloc::server
