#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace scanloc::mapdb {

/// How a map came about of others.
struct HistoryEntry {
  std::string when;                  ///< of whoever made it, for people, as 2026-11-28T19:00:00Z
  std::string command;               ///< what was asked for
  std::vector<std::string> parents;  ///< content ids of the maps that it was made of

  friend bool operator==(const HistoryEntry&, const HistoryEntry&) = default;
};

/// Of more, the newest are kept.
inline constexpr std::size_t kMaxHistory = 100;

/// As a map file holds it, and back: a line an entry, oldest first. What is no such text is
/// InvalidArgument.
[[nodiscard]] std::string EncodeHistory(const std::vector<HistoryEntry>& history);
[[nodiscard]] absl::StatusOr<std::vector<HistoryEntry>> DecodeHistory(const std::string& text);

}  // namespace scanloc::mapdb
