#include "cli/eval_checks.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>

#include "absl/strings/str_cat.h"

namespace scanloc::cli {
namespace {

/// With one query in so many at a place, the map was surely made of their drive.
constexpr std::size_t kOwnDriveShare = 10;

}  // namespace

void WarnOfOwnDrive(const std::vector<eval::EvalQuery>& queries) {
  const auto count = [&](auto&& is_counted) {
    return static_cast<std::size_t>(std::ranges::count_if(queries, is_counted));
  };
  const std::size_t num_at_place = count([](const eval::EvalQuery& query) {
    return query.has_place && query.variance.translation_m <= kSamePlace_m;
  });
  const std::size_t num_with_place =
      count([](const eval::EvalQuery& query) { return query.has_place; });
  if (num_at_place < 2 || num_at_place * kOwnDriveShare < num_with_place) return;
  std::fprintf(stderr,
               "scanloc eval: warning: %zu of %zu queries were taken at 0.00 m from a place; if "
               "the map was made of this drive, they find themselves: give --in-session\n",
               num_at_place, num_with_place);
}

absl::Status CheckSession(const Map& map, const std::vector<eval::EvalQuery>& queries) {
  if (map.sessions.size() > 1) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--in-session needs a map of one session; this one has ", map.sessions.size()));
  }
  // Drives may count their time from 0, which alone stands for none.
  const bool has_places =
      std::ranges::any_of(map.places, [](const Place& place) { return place.stamp_ns != 0; });
  const bool has_queries = std::ranges::any_of(
      queries, [](const eval::EvalQuery& query) { return query.stamp_ns != 0; });
  if (has_places && has_queries) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("--in-session needs to know when scans were taken, and those of the ",
                   has_places ? "queries have no times" : "map's places have none",
                   "; give --times at build and here, or poses with stamps"));
}

}  // namespace scanloc::cli
