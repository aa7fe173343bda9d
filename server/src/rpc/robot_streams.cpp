#include "rpc/robot_streams.hpp"

#include <atomic>
#include <list>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "admission/admission.hpp"
#include "admission/byte_budget.hpp"
#include "ops/clock.hpp"
#include "rpc/unary_call.hpp"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

/// Robots hold their streams for minutes.
constexpr double kStreamRetry_s = 5.0;
/// How long robots have, once the server drains, to read the answers under way.
constexpr std::chrono::seconds kAnswerGrace(1);

absl::Status DrainingError() {
  return proto::WithReason(
      v1::ERROR_REASON_DRAINING,
      absl::UnavailableError("the server is draining; open a stream to another, or later"));
}

absl::Status TooManyStreams(const std::string& text) {
  return proto::WithRetryAfter(
      proto::WithReason(v1::ERROR_REASON_TOO_MANY_STREAMS, absl::ResourceExhaustedError(text)),
      kStreamRetry_s);
}

}  // namespace

struct RobotStreams::Registry {
  Registry(WorkerPool& pool, const Limits& limits)
      : workers(pool),
        budget(limits.max_bytes),
        max_streams(limits.max_streams),
        max_per_client(limits.max_per_client > 0 ? limits.max_per_client : limits.max_streams),
        idle({.max_idle = limits.max_streams,
              .timeout = limits.idle,
              .full = "as many streams as the server takes wait for their robots",
              .expired = absl::StrCat("the robot was silent for ", limits.idle.count(),
                                      " s; open another stream")}) {}

  /// With mutex held.
  [[nodiscard]] absl::Status CheckRoomFor(const std::string& client) const;
  [[nodiscard]] std::shared_ptr<Stream> TakeReadable();

  /// Whether the stream may read its next request now; if not it is held, and is told to when there
  /// is memory.
  [[nodiscard]] bool MayRead(const std::shared_ptr<Stream>& stream);
  /// To be called when a request is let go of.
  void ResumeHeld();

  WorkerPool& workers;
  ByteBudget budget;  // of requests that run or wait for a worker
  const int max_streams;
  const int max_per_client;
  mutable std::mutex mutex;
  std::set<std::shared_ptr<Stream>> streams;  // those that were let in
  std::map<std::string, int> num_by_client;
  std::list<std::shared_ptr<Stream>> held;  // with their next request unread, in order
  bool is_draining = false;
  IdleCalls idle;  // streams that wait for their robots, to send or to read
};

/// One stream. Its work goes round: a read, a task on a worker, a write. Whoever does the next step
/// has it alone, and only who has it may end it: `idle` while the robot is waited for,
/// the worker while it answers, the registry while it is held.
class RobotStreams::Stream : public Reactor,
                             public IdleCall,
                             public std::enable_shared_from_this<Stream> {
 public:
  Stream(Registry& registry, StreamHandler handler)
      : registry_(registry), handler_(std::move(handler)) {}

  [[nodiscard]] const std::string& client() const { return handler_.client; }

  void Start(bool is_counted) {
    is_counted_ = is_counted;
    self_ = shared_from_this();
  }

  /// Waits for the next request, once there is memory for it.
  void Read() {
    if (registry_.MayRead(shared_from_this())) ReadNow();
  }

  void ReadNow() {
    AwaitRobot([this] { StartRead(&request_); });
    // Drain may have passed by before the stream came to wait.
    if (is_draining_ && registry_.idle.Leave(*this)) End(DrainingError());
  }

  void End(const absl::Status& status) {
    handler_.ended(status);
    Finish(proto::ToGrpc(status));
  }

  void Drain() {
    is_draining_ = true;
    // The answer under way is still to be read.
    if (registry_.idle.Leave(*this, [this] { return !is_writing_; })) End(DrainingError());
  }

  void OnReadDone(bool ok) override {
    if (!registry_.idle.Leave(*this)) return;       // it has been ended
    if (!ok) return End(absl::OkStatus());          // the robot has said all, or has gone
    if (is_draining_) return End(DrainingError());  // not begun yet
    share_ =
        ByteBudget::Share(registry_.budget, client(), static_cast<std::int64_t>(request_.Length()));
    const std::int64_t arrived_ns = NowNs();
    const absl::Status taken =
        Guard([&] { return registry_.workers.Submit(client(), TaskOf(arrived_ns)); });
    if (!taken.ok()) TryLater(arrived_ns);
  }

  void OnWriteDone(bool ok) override {
    if (!registry_.idle.Leave(*this)) return;  // it has been ended
    is_writing_ = false;
    if (!ok) return End(absl::CancelledError("the robot has gone"));
    if (is_draining_) return End(DrainingError());
    Read();
  }

  void OnDone() override {
    const std::shared_ptr<Stream> self = std::move(self_);
    if (!is_counted_) return;
    LetGoOfRequest();
    const std::lock_guard lock(registry_.mutex);
    registry_.streams.erase(self);
    if (const auto count = registry_.num_by_client.find(client()); --count->second == 0) {
      registry_.num_by_client.erase(count);
    }
  }

 private:
  void OnEvicted(const absl::Status& why) override {
    // The status would wait behind the answer that the robot does not read.
    if (is_writing_) handler_.context->TryCancel();
    End(why);
  }

  void LetGoOfRequest() {
    request_.Clear();
    share_ = {};
    registry_.ResumeHeld();
  }

  void AwaitRobot(const std::function<void()>& start) {
    if (auto status = registry_.idle.Enter(shared_from_this(), client(), start); !status.ok()) {
      End(status);
    }
  }

  [[nodiscard]] WorkerPool::Task TaskOf(std::int64_t arrived_ns) {
    return [this, arrived_ns](const absl::StatusOr<int>& worker) {
      // Without a time to come back it had no place, but there was no memory.
      if (!worker.ok() && !proto::RetryAfter(worker.status())) return End(worker.status());
      if (!worker.ok()) return TryLater(arrived_ns);
      Answer(arrived_ns, *worker);
    };
  }

  /// What a robot's stream knows of it is not lost to a queue that is full for a moment.
  void TryLater(std::int64_t arrived_ns) {
    const absl::Status taken = Guard([&] {
      registry_.workers.SubmitPatiently(client(), TaskOf(arrived_ns));
      return absl::OkStatus();
    });
    if (!taken.ok()) End(taken);
  }

  void Answer(std::int64_t arrived_ns, int worker) {
    response_.Clear();
    const absl::Status status = Respond<v1::LocalizeStreamRequest>(
        request_, &response_,
        [&](auto& request) { return handler_.answer(request, arrived_ns, worker); });
    LetGoOfRequest();  // whether the robot reads the answer or not
    if (!status.ok()) return End(status);
    is_writing_ = true;
    AwaitRobot([this] { StartWrite(&response_); });
  }

  Registry& registry_;
  const StreamHandler handler_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  ByteBudget::Share share_;  // of the request
  std::atomic<bool> is_draining_ = false;
  bool is_writing_ = false;
  bool is_counted_ = false;
  std::shared_ptr<Stream> self_;  // until gRPC is done with it
};

absl::Status RobotStreams::Registry::CheckRoomFor(const std::string& client) const {
  if (is_draining) return DrainingError();
  if (static_cast<int>(streams.size()) >= max_streams) {
    return TooManyStreams(absl::StrCat("as many streams as the server takes are open, ",
                                       max_streams, "; try again later or another server"));
  }
  const auto own = num_by_client.find(client);
  if (own != num_by_client.end() && own->second >= max_per_client) {
    return TooManyStreams(
        absl::StrCat("this client has ", max_per_client, " streams open, as many as one may"));
  }
  return absl::OkStatus();
}

std::shared_ptr<RobotStreams::Stream> RobotStreams::Registry::TakeReadable() {
  auto best = held.end();
  std::int64_t least_bytes = 0;
  for (auto stream = held.begin(); stream != held.end(); ++stream) {
    const std::string& client = (*stream)->client();
    const std::int64_t num_bytes = budget.BytesOf(client);
    if ((best != held.end() && num_bytes >= least_bytes) || budget.IsOverdrawnFor(client)) continue;
    best = stream;
    least_bytes = num_bytes;
  }
  if (best == held.end()) return nullptr;
  std::shared_ptr<Stream> taken = std::move(*best);
  held.erase(best);
  return taken;
}

bool RobotStreams::Registry::MayRead(const std::shared_ptr<Stream>& stream) {
  const std::lock_guard lock(mutex);
  if (is_draining || !budget.IsOverdrawnFor(stream->client())) return true;
  held.push_back(stream);
  return false;
}

void RobotStreams::Registry::ResumeHeld() {
  // One for one, so that not all of them send at once; all, where nothing else will resume them.
  do {
    std::shared_ptr<Stream> next;
    {
      const std::lock_guard lock(mutex);
      if (held.empty()) return;
      next = TakeReadable();
    }
    if (next == nullptr) return;
    next->ReadNow();
  } while (budget.IsEmpty());
}

RobotStreams::RobotStreams(WorkerPool& workers, const Limits& limits)
    : registry_(std::make_unique<Registry>(workers, limits)) {}

RobotStreams::~RobotStreams() = default;

RobotStreams::Reactor* RobotStreams::Open(StreamHandler handler, absl::Status admitted) {
  Metrics& metrics = *handler.metrics;
  const auto stream = std::make_shared<Stream>(*registry_, std::move(handler));
  absl::Status refused = std::move(admitted);
  if (refused.ok()) {
    const std::lock_guard lock(registry_->mutex);
    refused = registry_->CheckRoomFor(stream->client());
    if (refused.ok()) {
      registry_->streams.insert(stream);  // until OnDone, which comes in any case
      ++registry_->num_by_client[stream->client()];
    } else if (absl::IsResourceExhausted(refused)) {
      metrics.CountRejected("streams");
    }
  }
  stream->Start(/*is_counted=*/refused.ok());
  if (refused.ok()) {
    stream->Read();
  } else {
    stream->End(refused);
  }
  return stream.get();
}

void RobotStreams::Drain() {
  std::vector<std::shared_ptr<Stream>> streams;
  std::list<std::shared_ptr<Stream>> held;
  {
    const std::lock_guard lock(registry_->mutex);
    registry_->is_draining = true;
    streams.assign(registry_->streams.begin(), registry_->streams.end());
    held.swap(registry_->held);
  }
  for (const std::shared_ptr<Stream>& stream : streams) stream->Drain();
  for (const std::shared_ptr<Stream>& stream : held) stream->End(DrainingError());
  registry_->idle.Drain(kAnswerGrace);
}

int RobotStreams::num_open() const {
  const std::lock_guard lock(registry_->mutex);
  return static_cast<int>(registry_->streams.size());
}

}  // namespace scanloc::server
