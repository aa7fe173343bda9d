#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

namespace scanloc::cli {

/// Tells on stderr how far a long work is: a bar on a terminal, else a line each tenth of it.
/// Not thread-safe.
class Progress {
 public:
  /// `what` is what is counted, for example "scans built".
  Progress(std::string what, bool quiet);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();  ///< Clear

  void Update(std::size_t num_done, std::size_t num_total);

  /// Takes the bar off the terminal, so that other text can be written.
  void Clear();

 private:
  void DrawBar(std::size_t num_done, std::size_t num_total);

  using Clock = std::chrono::steady_clock;
  enum class Style { kNone, kBar, kLines };

  const std::string what_;
  const Style style_;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point drawn_;
  bool bar_shown_ = false;
  bool started_ = false;
  std::size_t first_done_ = 0;  // where a resumed work began
  std::size_t tenths_told_ = 0;
};

/// Progress of a work of several stages, one after the other.
class StageProgress {
 public:
  explicit StageProgress(bool quiet) : quiet_(quiet) {}

  void Update(const std::string& stage, std::size_t num_done, std::size_t num_total) {
    // A stage that begins anew is another one.
    if (!progress_ || stage != stage_ || num_done < num_done_) progress_.emplace(stage, quiet_);
    stage_ = stage;
    num_done_ = num_done;
    progress_->Update(num_done, num_total);
  }

  void Clear() { progress_.reset(); }

 private:
  const bool quiet_;
  std::string stage_;
  std::size_t num_done_ = 0;
  std::optional<Progress> progress_;
};

}  // namespace scanloc::cli
