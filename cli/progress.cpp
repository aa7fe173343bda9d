#include "cli/progress.hpp"

#include <unistd.h>

#include <cstdio>
#include <utility>

#include "absl/strings/str_format.h"

namespace scanloc::cli {
namespace {

constexpr std::size_t kBarChars = 30;
constexpr auto kRedrawInterval = std::chrono::milliseconds(100);

}  // namespace

Progress::Progress(std::string what, bool quiet)
    : what_(std::move(what)),
      style_(quiet                   ? Style::kNone
             : isatty(STDERR_FILENO) ? Style::kBar
                                     : Style::kLines) {}

Progress::~Progress() { Clear(); }

void Progress::Update(std::size_t num_done, std::size_t num_total) {
  if (style_ == Style::kNone || num_total == 0) return;
  const std::size_t tenths = 10 * num_done / num_total;
  if (!started_) {
    started_ = true;
    first_done_ = num_done > 0 ? num_done - 1 : 0;
    tenths_told_ = 10 * first_done_ / num_total;
  }
  if (style_ == Style::kBar) {
    const Clock::time_point now = Clock::now();
    if (bar_shown_ && num_done < num_total && now - drawn_ < kRedrawInterval) return;
    drawn_ = now;
    DrawBar(num_done, num_total);
  } else if (tenths > tenths_told_) {
    tenths_told_ = tenths;
    absl::FPrintF(stderr, "%d of %d %s (%d %%)\n", num_done, num_total, what_,
                  100 * num_done / num_total);
  }
}

void Progress::DrawBar(std::size_t num_done, std::size_t num_total) {
  const std::size_t filled = kBarChars * num_done / num_total;
  const double elapsed_s = std::chrono::duration<double>(drawn_ - start_).count();
  const std::size_t here = num_done - first_done_;
  std::string left;
  if (elapsed_s > 1.0 && here > 0) {
    left = absl::StrFormat(", %.0f s left", elapsed_s / static_cast<double>(here) *
                                                static_cast<double>(num_total - num_done));
  }
  bar_shown_ = true;
  absl::FPrintF(stderr, "\r\033[K[%s%s] %3d %%  %d of %d %s%s", std::string(filled, '#'),
                std::string(kBarChars - filled, '.'), 100 * num_done / num_total, num_done,
                num_total, what_, left);
  std::fflush(stderr);
}

void Progress::Clear() {
  if (!bar_shown_) return;
  bar_shown_ = false;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
}

}  // namespace scanloc::cli
