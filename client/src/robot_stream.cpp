#include <grpcpp/client_context.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "call_metadata.hpp"
#include "client_state.hpp"
#include "scanloc/client/client.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/status.hpp"
#include "scanloc/v1/localization.grpc.pb.h"

namespace scanloc::client {
namespace {

/// A LocalizeStream call, one request and its response at a time, each in its time. One thread at a
/// time may call.
class StreamCall final
    : private grpc::ClientBidiReactor<v1::LocalizeStreamRequest, v1::LocalizeStreamResponse> {
 public:
  /// The stub must outlive the call.
  StreamCall(v1::Localization::Stub& stub, const ClientOptions& options,
             const std::string& request_id, const std::string& map) {
    ShowToken(options, context_);
    SendRequestId(request_id, context_);
    SendMapName(map, context_);
    stub.async()->LocalizeStream(&context_, this);
    AddHold();  // reads and writes are started from outside
    StartCall();
  }
  ~StreamCall() override {
    std::unique_lock lock(mutex_);
    if (!end_) context_.TryCancel();
    (void)AwaitEnd(lock);
  }  ///< cancels what is under way and waits for its end

  /// After an error the call has ended.
  [[nodiscard]] absl::Status Ask(const v1::LocalizeStreamRequest& request,
                                 std::chrono::milliseconds timeout,
                                 v1::LocalizeStreamResponse* response) {
    RETURN_IF_ERROR(CheckTexts(request));
    std::unique_lock lock(mutex_);
    if (!is_held_) return absl::FailedPreconditionError("the stream has ended; open another");
    request_ = request;
    num_under_way_ = 2;
    lock.unlock();
    StartRead(&response_);
    StartWrite(&request_);
    lock.lock();
    const bool is_in_time =
        has_news_.wait_for(lock, timeout, [&] { return has_failed_ || num_under_way_ == 0; });
    if (is_in_time && !has_failed_) {
      response->Swap(&response_);
      return absl::OkStatus();
    }
    if (!is_in_time) context_.TryCancel();
    absl::Status end = AwaitEnd(lock);
    if (!is_in_time) {
      return absl::DeadlineExceededError(
          "it did not answer the scan in time; the stream is closed");
    }
    return end.ok() ? absl::UnavailableError("it ended the stream") : end;
  }
  /// Ends the call; the status that it ended with. May be called again.
  absl::Status Close(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    if (std::exchange(is_held_, false)) {
      lock.unlock();
      StartWritesDone();
      RemoveHold();
      lock.lock();
    }
    if (!has_news_.wait_for(lock, timeout, [&] { return end_.has_value(); })) {
      context_.TryCancel();
      has_news_.wait(lock, [&] { return end_.has_value(); });
      return absl::DeadlineExceededError("it did not end the stream in time");
    }
    return *end_;
  }

 private:
  void OnWriteDone(bool ok) override { EndOne(ok); }
  void OnReadDone(bool ok) override { EndOne(ok); }
  void OnDone(const grpc::Status& status) override {
    const std::lock_guard lock(mutex_);
    end_ = proto::FromGrpc(status);
    has_news_.notify_all();
  }

  /// Of a write and a read.
  void EndOne(bool ok) {
    const std::lock_guard lock(mutex_);
    --num_under_way_;
    has_failed_ |= !ok;
    has_news_.notify_all();
  }
  /// Gives up the right to start further work, and waits for the end.
  absl::Status AwaitEnd(std::unique_lock<std::mutex>& lock) {
    if (std::exchange(is_held_, false)) {
      lock.unlock();
      RemoveHold();
      lock.lock();
    }
    has_news_.wait(lock, [&] { return end_.has_value(); });
    return *end_;
  }

  grpc::ClientContext context_;
  v1::LocalizeStreamRequest request_;
  v1::LocalizeStreamResponse response_;
  std::mutex mutex_;
  std::condition_variable has_news_;
  int num_under_way_ = 0;  // a write, a read
  bool has_failed_ = false;
  bool is_held_ = true;
  std::optional<absl::Status> end_;
};

}  // namespace

using std::chrono::milliseconds;

/// A robot whose scans a server weighs.
class Client::ServedRobot final : public RobotStream::Tracking {
 public:
  ServedRobot(std::shared_ptr<State> client, const StreamOptions& options,
              std::shared_ptr<CachedMap> map)
      : client_(std::move(client)),
        options_(options),
        timeout_(options.timeout.value_or(client_->options.timeout)),
        map_(std::move(map)),
        call_(*client_->stub, client_->options, options.request_id, options.map) {}
  ~ServedRobot() override { (void)Close(); }

  absl::Status Open() {
    v1::LocalizeStreamRequest request;
    v1::StreamConfig& config = *request.mutable_config();
    config.set_map(options_.map);
    *config.mutable_options() = proto::ToProto(options_.query, options_.budget);
    config.set_max_step_m(options_.max_step_m);
    v1::LocalizeStreamResponse response;
    if (auto status = call_.Ask(request, timeout_, &response); !status.ok()) {
      return client_->WithAddress(status);
    }
    return response.has_opened()
               ? absl::OkStatus()
               : client_->BadReply(absl::InternalError("a stream was not opened"));
  }

  absl::StatusOr<TrackedReply> Locate(PointView scan, const std::optional<Pose>& T_last_scan,
                                      const ScanHeader& header) override {
    RETURN_IF_ERROR(CheckScanSize(scan));
    auto reply = Ask(scan, T_last_scan, header);
    if (map_ == nullptr || proto::ReasonOf(reply.status()) != v1::ERROR_REASON_PARAMS_MISMATCH) {
      return reply;
    }
    // The map was replaced by one that wants other descriptors. The scan has been counted.
    ASSIGN_OR_RETURN(const auto terms, client_->TermsOf(options_.timeout, options_.request_id));
    ASSIGN_OR_RETURN(map_, client_->FetchMap(options_.map, terms));
    return Ask(scan, Pose::Identity(), header);
  }

  absl::Status Close() override { return client_->WithAddress(call_.Close(timeout_)); }

 private:
  [[nodiscard]] absl::StatusOr<TrackedReply> Ask(PointView scan,
                                                 const std::optional<Pose>& T_last_scan,
                                                 const ScanHeader& header) {
    v1::LocalizeStreamRequest request;
    v1::StreamScan& message = *request.mutable_scan();
    if (map_ == nullptr) {
      *message.mutable_scan() = proto::ToProto(scan, options_.mount);
    } else {
      ASSIGN_OR_RETURN(const auto descriptor, map_->Describe(scan, options_.mount));
      *message.mutable_descriptors() = proto::ToProto(descriptor);
    }
    // Who describes the scan here tells the server of the turned frame, and hears of it.
    const SensorMount turned_here = map_ != nullptr ? options_.mount : SensorMount();
    std::optional<Pose> T_last = T_last_scan;
    if (T_last) T_last = TurnedStep(turned_here, *T_last);
    proto::SetOdometry(T_last, &message);
    message.set_stamp_ns(header.stamp_ns);
    message.set_frame_id(header.frame_id);
    v1::LocalizeStreamResponse response;
    if (auto status = call_.Ask(request, timeout_, &response); !status.ok()) {
      return client_->WithAddress(status);
    }
    if (response.has_error()) {
      return client_->WithAddress(proto::FromErrorStatus(response.error()));
    }
    ASSIGN_OR_RETURN(auto reply, client_->Read(response.answer()));
    TellOfBase(turned_here, reply.reply.answer);
    return reply;
  }

  const std::shared_ptr<State> client_;
  const StreamOptions options_;
  const milliseconds timeout_;
  std::shared_ptr<CachedMap> map_;  // null where scans are sent as they are
  StreamCall call_;
};

absl::StatusOr<RobotStream> Client::OpenStream(const StreamOptions& options) const {
  ASSIGN_OR_RETURN(const auto terms, state_->TermsOf(options.timeout, options.request_id));
  std::shared_ptr<CachedMap> map;
  if (options.send_descriptor) {
    ASSIGN_OR_RETURN(map, state_->FetchMap(options.map, terms));
  }
  auto robot = std::make_unique<ServedRobot>(state_, options, std::move(map));
  RETURN_IF_ERROR(robot->Open());
  return RobotStream(std::move(robot));
}

}  // namespace scanloc::client
