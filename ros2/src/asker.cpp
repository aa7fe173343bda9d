#include "asker.hpp"

#include <exception>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::ros2 {

namespace {

/// Whether the stream was over, rather than the question bad or the server busy.
bool IsOver(const absl::Status& error) {
  return absl::IsFailedPrecondition(error) || absl::IsUnavailable(error) ||
         absl::IsCancelled(error) || absl::IsAborted(error);
}

}  // namespace

absl::StatusOr<TrackedReply> Asker::Ask(const Question& question) {
  if (question.begins_anew || !(question.mount == options_.mount)) stream_.reset();
  options_.mount = question.mount;
  const bool was_open = stream_.has_value();
  for (bool is_first = true;; is_first = false) {
    if (!stream_) {
      ASSIGN_OR_RETURN(stream_, client_->OpenStream(options_));
    }
    const bool continues = is_first && was_open;
    auto reply =
        stream_->Locate(question.scan, continues ? question.T_last_scan : std::optional<Pose>());
    if (reply.ok()) return reply;
    stream_.reset();
    if (!continues || !IsOver(reply.status())) return reply;
  }
}

AskerThread::AskerThread(Asker asker, std::function<void()> has_reply)
    : asker_(std::move(asker)), has_reply_(std::move(has_reply)), thread_([this] { Run(); }) {}

AskerThread::~AskerThread() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void AskerThread::Start(Question question) {
  {
    const std::lock_guard lock(mutex_);
    question_ = std::move(question);
    is_busy_ = true;
  }
  changed_.notify_one();
}

std::optional<absl::StatusOr<TrackedReply>> AskerThread::TakeReply() {
  const std::lock_guard lock(mutex_);
  return std::exchange(reply_, std::nullopt);
}

bool AskerThread::IsBusy() const {
  const std::lock_guard lock(mutex_);
  return is_busy_;
}

void AskerThread::Run() {
  while (true) {
    Question question;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return ends_ || question_; });
      if (ends_) return;
      question = *std::exchange(question_, std::nullopt);
    }
    absl::StatusOr<TrackedReply> reply = absl::InternalError("no reply");
    try {
      reply = asker_.Ask(question);
    } catch (const std::exception& error) {  // of memory, above all
      reply = absl::ResourceExhaustedError(absl::StrCat("the question failed: ", error.what()));
    }
    {
      const std::lock_guard lock(mutex_);
      reply_ = std::move(reply);
      is_busy_ = false;
    }
    has_reply_();
  }
}

}  // namespace scanloc::ros2
