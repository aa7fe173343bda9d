#pragma once

#include <chrono>
#include <cstddef>
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

}  // namespace scanloc::cli
