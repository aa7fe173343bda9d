#include "dds_log.hpp"

#include <dds/ddsrt/log.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <mutex>
#include <string_view>

#include "scanloc/core/printable.hpp"

namespace scanloc::ros2 {
namespace {

using Clock = std::chrono::steady_clock;

std::atomic<std::size_t> num_malformed = 0;

// Called by threads of DDS.
void Log(void* /*argument*/, const dds_log_data_t* line) {
  constexpr std::chrono::seconds kSilence(10);
  static std::mutex mutex;
  static Clock::time_point silent_until;
  std::string_view text(line->message, line->size);
  while (!text.empty() && text.back() == '\n') text.remove_suffix(1);
  if (text.find("deserialization") != std::string_view::npos ||
      text.find("malformed packet") != std::string_view::npos) {
    ++num_malformed;
  }
  const std::lock_guard lock(mutex);
  const Clock::time_point now = Clock::now();
  if (now < silent_until && (line->priority & (DDS_LC_FATAL | DDS_LC_ERROR)) == 0) return;
  silent_until = now + kSilence;
  std::fprintf(stderr, "scanloc-ros2: DDS: %s\n", Printable(text).c_str());
}

}  // namespace

void CatchDdsLog() { dds_set_log_sink(&Log, nullptr); }

std::size_t NumMalformed() { return num_malformed; }

}  // namespace scanloc::ros2
