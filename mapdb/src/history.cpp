#include "scanloc/mapdb/history.hpp"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "scanloc/core/printable.hpp"

namespace scanloc::mapdb {

std::string EncodeHistory(const std::vector<HistoryEntry>& history) {
  std::string text;
  const std::size_t first = history.size() > kMaxHistory ? history.size() - kMaxHistory : 0;
  for (std::size_t i = first; i < history.size(); ++i) {
    // Printable text has neither tabs nor line ends.
    absl::StrAppend(&text, Printable(history[i].when), "\t",
                    Printable(absl::StrJoin(history[i].parents, ",")), "\t",
                    Printable(history[i].command), "\n");
  }
  return text;
}

absl::StatusOr<std::vector<HistoryEntry>> DecodeHistory(const std::string& text) {
  std::vector<HistoryEntry> history;
  for (const absl::string_view line : absl::StrSplit(text, '\n', absl::SkipEmpty())) {
    const std::vector<std::string> fields = absl::StrSplit(line, '\t');
    if (fields.size() != 3 || history.size() == kMaxHistory) {
      return absl::InvalidArgumentError(
          absl::StrCat("history: line ", history.size() + 1, " is malformed"));
    }
    history.push_back({fields[0], fields[2], absl::StrSplit(fields[1], ',', absl::SkipEmpty())});
  }
  return history;
}

}  // namespace scanloc::mapdb
