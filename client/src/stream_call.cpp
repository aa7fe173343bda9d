#include "stream_call.hpp"

#include <utility>

#include "call_metadata.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/status.hpp"

namespace scanloc::client {

StreamCall::StreamCall(v1::Localization::Stub& stub, const ClientOptions& options,
                       const std::string& request_id, const std::string& map) {
  ShowToken(options, context_);
  SendRequestId(request_id, context_);
  SendMapName(map, context_);
  stub.async()->LocalizeStream(&context_, this);
  AddHold();  // reads and writes are started from outside
  StartCall();
}

StreamCall::~StreamCall() {
  std::unique_lock lock(mutex_);
  if (!end_) context_.TryCancel();
  (void)AwaitEnd(lock);
}

void StreamCall::EndOne(bool ok) {
  const std::lock_guard lock(mutex_);
  --num_under_way_;
  has_failed_ |= !ok;
  has_news_.notify_all();
}

void StreamCall::OnDone(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  end_ = proto::FromGrpc(status);
  has_news_.notify_all();
}

absl::Status StreamCall::AwaitEnd(std::unique_lock<std::mutex>& lock) {
  if (std::exchange(is_held_, false)) {
    lock.unlock();
    RemoveHold();
    lock.lock();
  }
  has_news_.wait(lock, [&] { return end_.has_value(); });
  return *end_;
}

absl::Status StreamCall::Ask(const v1::LocalizeStreamRequest& request,
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
    return absl::DeadlineExceededError("it did not answer the scan in time; the stream is closed");
  }
  return end.ok() ? absl::UnavailableError("it ended the stream") : end;
}

absl::Status StreamCall::Close(std::chrono::milliseconds timeout) {
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

}  // namespace scanloc::client
