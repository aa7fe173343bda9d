#include "cli/provenance.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <utility>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "scanloc/core/printable.hpp"

namespace scanloc::cli {
namespace {

std::string Now() {
  return absl::FormatTime("%Y-%m-%dT%H:%M:%SZ", absl::Now(), absl::UTCTimeZone());
}

}  // namespace

report::Provenance MadeNow() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::string command{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  while (!command.empty() && command.back() == '\0') command.pop_back();
  std::ranges::replace(command, '\0', ' ');
  return {.version = SCANLOC_VERSION, .command = Printable(command), .date = Now()};
}

mapdb::HistoryEntry MadeNow(std::string command) {
  return {.when = Now(), .command = std::move(command), .parents = {}};
}

}  // namespace scanloc::cli
