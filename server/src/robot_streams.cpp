#include "robot_streams.hpp"

#include <chrono>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scanloc/proto/status.hpp"
#include "unary_call.hpp"

namespace scanloc::server {
namespace {

std::int64_t NowNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

absl::Status DrainingError() {
  return absl::UnavailableError("the server is draining; open a stream to another, or later");
}

}  // namespace

struct RobotStreams::Registry {
  Registry(WorkerPool& pool, int max) : workers(pool), max_streams(max) {}

  WorkerPool& workers;
  const int max_streams;
  mutable std::mutex mutex;
  std::set<std::shared_ptr<Stream>> streams;
  bool is_draining = false;
};

/// One stream. Its work goes round: a read, a task on a worker, a write. Only Drain comes from
/// aside; `is_finished_` says who ended the stream.
class RobotStreams::Stream : public Reactor, public std::enable_shared_from_this<Stream> {
 public:
  Stream(std::shared_ptr<Registry> registry, StreamAnswerer answerer)
      : registry_(std::move(registry)), answerer_(std::move(answerer)) {}

  void Start() { Read(); }

  void End(const absl::Status& status) {
    {
      const std::lock_guard lock(mutex_);
      if (std::exchange(is_finished_, true)) return;
    }
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
      return registry_->workers.Submit([self = shared_from_this(), arrived_ns](int worker) {
        self->Answer(arrived_ns, worker);
      });
    });
    if (!taken.ok()) End(taken);
  }

  void OnWriteDone(bool ok) override {
    if (!ok) return End(absl::CancelledError("the robot has gone"));
    Read();
  }

  void OnDone() override {
    const std::shared_ptr<Stream> self = shared_from_this();
    const std::lock_guard lock(registry_->mutex);
    registry_->streams.erase(self);
  }

 private:
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
        [&](const auto& request) { return answerer_(request, arrived_ns, worker); });
    if (!status.ok()) return End(status);
    bool is_over = false;
    {
      const std::lock_guard lock(mutex_);
      is_over = is_finished_;
    }
    if (!is_over) StartWrite(&response_);
  }

  const std::shared_ptr<Registry> registry_;
  const StreamAnswerer answerer_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  std::mutex mutex_;
  bool is_reading_ = false;
  bool is_draining_ = false;
  bool is_finished_ = false;
};

RobotStreams::RobotStreams(WorkerPool& workers, int max_streams)
    : registry_(std::make_shared<Registry>(workers, max_streams)) {}

RobotStreams::~RobotStreams() { Drain(); }

RobotStreams::Reactor* RobotStreams::Open(StreamAnswerer answerer, absl::Status admitted) {
  const auto stream = std::make_shared<Stream>(registry_, std::move(answerer));
  absl::Status refused = std::move(admitted);
  {
    const std::lock_guard lock(registry_->mutex);
    if (!refused.ok()) {
      // Counts as open until OnDone, as all do.
    } else if (registry_->is_draining) {
      refused = DrainingError();
    } else if (static_cast<int>(registry_->streams.size()) >= registry_->max_streams) {
      refused = absl::ResourceExhaustedError(
          absl::StrCat("as many streams as the server takes are open, ", registry_->max_streams,
                       "; try again later or another server"));
    }
    registry_->streams.insert(stream);  // until OnDone, which comes in any case
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
