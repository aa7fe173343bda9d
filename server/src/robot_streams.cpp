#include "robot_streams.hpp"

#include <map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "reception.hpp"
#include "scanloc/proto/status.hpp"
#include "unary_call.hpp"

namespace scanloc::server {
namespace {

/// Robots hold their streams for minutes.
constexpr double kStreamRetry_s = 5.0;

absl::Status DrainingError() {
  return absl::UnavailableError("the server is draining; open a stream to another, or later");
}

}  // namespace

struct RobotStreams::Registry {
  Registry(WorkerPool& pool, int max, int max_of_one)
      : workers(pool), max_streams(max), max_per_client(max_of_one > 0 ? max_of_one : max) {}

  /// With mutex held.
  [[nodiscard]] absl::Status CheckRoomFor(const std::string& client) const;

  WorkerPool& workers;
  const int max_streams;
  const int max_per_client;
  mutable std::mutex mutex;
  std::set<std::shared_ptr<Stream>> streams;
  std::map<std::string, int> num_by_client;
  bool is_draining = false;
};

/// One stream. Its work goes round: a read, a task on a worker, a write. Only Drain comes from
/// aside; `is_finished_` says who ended the stream.
class RobotStreams::Stream : public Reactor, public std::enable_shared_from_this<Stream> {
 public:
  Stream(std::shared_ptr<Registry> registry, StreamHandler handler)
      : registry_(std::move(registry)), handler_(std::move(handler)) {}

  [[nodiscard]] const std::string& client() const { return handler_.client; }

  void Start() { Read(); }

  void End(const absl::Status& status) {
    {
      const std::lock_guard lock(mutex_);
      if (std::exchange(is_finished_, true)) return;
    }
    handler_.ended(status);
    Finish(proto::ToGrpc(status));
  }

  void Drain() {
    {
      const std::lock_guard lock(mutex_);
      is_draining_ = true;
      if (!is_reading_) return;
    }
    End(DrainingError());
  }

  void OnReadDone(bool ok) override {
    {
      const std::lock_guard lock(mutex_);
      is_reading_ = false;
    }
    if (!ok) return End(absl::OkStatus());  // the robot has said all, or has gone
    const std::int64_t arrived_ns = NowNs();
    // Once taken, the task runs; the stream cannot end before it, but for a stream that Drain
    // ended.
    const absl::Status taken = Guard([&] {
      return registry_->workers.Submit(handler_.client, [self = shared_from_this(), arrived_ns](
                                                            const absl::StatusOr<int>& worker) {
        if (!worker.ok()) return self->Refuse(worker.status());
        self->Answer(arrived_ns, *worker);
      });
    });
    if (!taken.ok()) Refuse(taken);
  }

  void OnWriteDone(bool ok) override {
    if (!ok) return End(absl::CancelledError("the robot has gone"));
    Read();
  }

  void OnDone() override {
    const std::shared_ptr<Stream> self = shared_from_this();
    const std::lock_guard lock(registry_->mutex);
    registry_->streams.erase(self);
    if (const auto count = registry_->num_by_client.find(client()); --count->second == 0) {
      registry_->num_by_client.erase(count);
    }
  }

 private:
  void Refuse(const absl::Status& status) {
    handler_.metrics->CountRejected("busy");
    End(status);
  }

  void Read() {
    bool is_over = false;
    {
      const std::lock_guard lock(mutex_);
      is_over = is_draining_;
      is_reading_ = !is_over;
    }
    if (is_over) return End(DrainingError());
    request_.Clear();
    StartRead(&request_);
  }

  void Answer(std::int64_t arrived_ns, int worker) {
    response_.Clear();
    const absl::Status status = Respond<v1::LocalizeStreamRequest>(
        request_, &response_,
        [&](const auto& request) { return handler_.answer(request, arrived_ns, worker); });
    if (!status.ok()) return End(status);
    bool is_over = false;
    {
      const std::lock_guard lock(mutex_);
      is_over = is_finished_;
    }
    if (!is_over) StartWrite(&response_);
  }

  const std::shared_ptr<Registry> registry_;
  const StreamHandler handler_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  std::mutex mutex_;
  bool is_reading_ = false;
  bool is_draining_ = false;
  bool is_finished_ = false;
};

absl::Status RobotStreams::Registry::CheckRoomFor(const std::string& client) const {
  if (is_draining) return DrainingError();
  if (static_cast<int>(streams.size()) >= max_streams) {
    return proto::WithRetryAfter(absl::ResourceExhaustedError(absl::StrCat(
                                     "as many streams as the server takes are open, ", max_streams,
                                     "; try again later or another server")),
                                 kStreamRetry_s);
  }
  const auto own = num_by_client.find(client);
  if (own != num_by_client.end() && own->second >= max_per_client) {
    return proto::WithRetryAfter(
        absl::ResourceExhaustedError(
            absl::StrCat("this client has ", max_per_client, " streams open, as many as one may")),
        kStreamRetry_s);
  }
  return absl::OkStatus();
}

RobotStreams::RobotStreams(WorkerPool& workers, int max_streams, int max_per_client)
    : registry_(std::make_shared<Registry>(workers, max_streams, max_per_client)) {}

RobotStreams::~RobotStreams() { Drain(); }

RobotStreams::Reactor* RobotStreams::Open(StreamHandler handler, absl::Status admitted) {
  Metrics& metrics = *handler.metrics;
  const auto stream = std::make_shared<Stream>(registry_, std::move(handler));
  absl::Status refused = std::move(admitted);
  {
    const std::lock_guard lock(registry_->mutex);
    if (refused.ok()) {
      refused = registry_->CheckRoomFor(stream->client());
      if (absl::IsResourceExhausted(refused)) metrics.CountRejected("streams");
    }
    registry_->streams.insert(stream);  // until OnDone, which comes in any case
    ++registry_->num_by_client[stream->client()];
  }
  if (refused.ok()) {
    stream->Start();
  } else {
    stream->End(refused);
  }
  return stream.get();
}

void RobotStreams::Drain() {
  std::vector<std::shared_ptr<Stream>> streams;
  {
    const std::lock_guard lock(registry_->mutex);
    registry_->is_draining = true;
    streams.assign(registry_->streams.begin(), registry_->streams.end());
  }
  for (const std::shared_ptr<Stream>& stream : streams) stream->Drain();
}

int RobotStreams::num_open() const {
  const std::lock_guard lock(registry_->mutex);
  return static_cast<int>(registry_->streams.size());
}

}  // namespace scanloc::server
