#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
namespace scanloc::server {

/// Files whose content is taken up anew when it changes, while the server runs. They are read once
/// a second and told by what they hold, so that neither a time stamp that is set back nor a moment
/// in which they cannot be read hides a change. What they hold counts as known only once it was
/// taken up: until then it is offered again every second, and what was before stays in force.
///
/// Trouble is told (log, scanloc_file_unusable, on_trouble) once two looks found the same: an
/// operator may just be between two files. Thread-safe.
class FileWatch {
 public:
  using Clock = std::chrono::steady_clock;
  using Texts = std::vector<std::string>;

  struct Subject {
    std::string name;                ///< of the metric, such as "tokens"
    std::vector<std::string> paths;  ///< regular files of at most 16 MiB
    /// Takes up what the files hold, in their order. On an error what was before stays in force.
    std::function<absl::Status(const Texts&)> take_up;
    std::function<void()> on_trouble = [] {};  ///< once for each trouble that is told
  };

  explicit FileWatch(Subject subject) : subject_(std::move(subject)) {}

  /// Reads the files and takes up what is new; from one thread at a time.
  absl::Status Look(Clock::time_point now = Clock::now());

  /// Told of the subject by its name: whether its files cannot be used. From Start until Stop.
  using Tell = std::function<void(const std::string& name, bool is_unusable)>;

  /// Looks every second from now on, and tells.
  void Start(Tell tell);
  void Stop() { thread_ = {}; }

  /// How long it has been unknown what the files hold; 0 while it is known.
  [[nodiscard]] Clock::duration UnknownFor(Clock::time_point now = Clock::now()) const;

 private:
  using Digest = std::array<unsigned char, 32>;

  [[nodiscard]] absl::Status ReadAll(Texts& texts) const;
  [[nodiscard]] static Digest DigestOf(const Texts& texts);
  void Run(const std::stop_token& stop, const Tell& tell);
  void NoteTrouble(const absl::Status& why, const Digest& found, Clock::time_point now);

  const Subject subject_;
  // Of the thread that looks: what was taken up, and the trouble that the last look found.
  std::optional<Digest> known_;
  std::optional<Digest> bad_;
  absl::Status why_bad_;
  bool is_told_ = false;
  mutable std::mutex mutex_;  // guards all below
  std::condition_variable_any ends_;
  std::optional<Clock::time_point> unknown_since_;
  std::jthread thread_;
};

}  // namespace scanloc::server
