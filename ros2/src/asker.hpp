#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "absl/status/statusor.h"
#include "lookout.hpp"
#include "scanloc/client/localization_client.hpp"

namespace scanloc::ros2 {

/// Puts questions to a server or a map, on a stream that is opened when needed. One thread.
class Asker {
 public:
  Asker(std::shared_ptr<const client::LocalizationClient> client, client::StreamOptions options)
      : client_(std::move(client)), options_(std::move(options)) {}

  /// A stream that was over when the question came, as after a long silence, is opened again.
  [[nodiscard]] absl::StatusOr<TrackedReply> Ask(const Question& question);

 private:
  const std::shared_ptr<const client::LocalizationClient> client_;
  client::StreamOptions options_;  // with the mount of the last question
  std::optional<client::RobotStream> stream_;
};

/// An Asker on a thread of its own, one question at a time.
class AskerThread {
 public:
  /// has_reply is called from the thread when a reply is there to be taken.
  AskerThread(Asker asker, std::function<void()> has_reply);
  /// Waits for the question under way.
  ~AskerThread();

  /// Requires that no question is under way.
  void Start(Question question);
  /// None while the question is under way, or there was none.
  [[nodiscard]] std::optional<absl::StatusOr<TrackedReply>> TakeReply();
  [[nodiscard]] bool IsBusy() const;

 private:
  void Run();

  Asker asker_;
  const std::function<void()> has_reply_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Question> question_;
  std::optional<absl::StatusOr<TrackedReply>> reply_;
  bool is_busy_ = false;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace scanloc::ros2
