#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "admission/idle_calls.hpp"
#include "ops/metrics.hpp"
#include "rpc/raw_service.hpp"
#include "scanloc/server/worker_pool.hpp"
#include "scanloc/v1/localization.pb.h"

namespace scanloc::server {

/// What answers the requests of one stream, one after the other, on whatever worker is free.
/// Dropped when the stream ends.
using StreamAnswerer = std::function<absl::StatusOr<v1::LocalizeStreamResponse>(
    v1::LocalizeStreamRequest& request, std::int64_t arrived_ns, int worker)>;

/// One stream, as the service sees it.
struct StreamHandler {
  grpc::CallbackServerContext* context = nullptr;
  std::string client;  ///< whose turn it takes
  StreamAnswerer answer;
  /// Once, with the status that the robot gets; from any thread.
  std::function<void(const absl::Status&)> ended;
  Metrics* metrics = nullptr;
};

/// The open streams of a server, at most so many. Of each stream one request at a time is read,
/// answered and its answer written, so that a robot that sends faster than it is answered is held
/// up by the flow control of its own connection. A request that the workers have no room for waits
/// until they have; while such requests fill the memory meant for them, or a client's part of it,
/// the next one of a stream is left unread. A robot that neither sends nor reads for too long loses
/// its stream. Thread-safe.
class RobotStreams {
 public:
  using Reactor = RawService::Reactor;

  struct Limits {
    int max_streams = 0;
    int max_per_client = 0;  ///< 0: as many as there may be
    std::chrono::duration<double> idle{};
    std::int64_t max_bytes = 0;  ///< of requests that run or wait for a worker
  };

  /// The pool must outlive the streams, and they end before this does.
  RobotStreams(WorkerPool& workers, const Limits& limits);
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
  const std::unique_ptr<Registry> registry_;
};

}  // namespace scanloc::server
