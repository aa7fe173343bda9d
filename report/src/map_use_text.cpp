#include "scanloc/report/map_use_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/map_use.hpp"
#include "scanloc/core/median.hpp"

namespace scanloc::report {
namespace {

/// A place that was seen less often says nothing yet.
constexpr std::int64_t kMinSeen = 3;
/// What lies below happens at any sound place: traffic, an odd lane. Measured over made towns
/// (docs/operations.md).
constexpr double kClear = 0.44;
constexpr double kBeside = 0.34;
constexpr double kTogether_m = 10.0;
constexpr double kBeside_m = 16.0;
constexpr double kSameFloor_m = 1.5;

struct Seen {
  std::int32_t place = 0;
  Eigen::Vector3d at;
  std::int64_t num = 0;
  double alone = 0.0;
  double together = 0.0;
};

/// Places by position.
class Grid {
 public:
  explicit Grid(std::span<const Seen> all) : all_(all) {
    for (std::size_t i = 0; i < all.size(); ++i) cells_[CellOf(all[i].at)].push_back(i);
  }

  template <typename Visit>
  void VisitNear(const Eigen::Vector3d& at, double within_m, Visit&& visit) const {
    const auto [column, row] = CellOf(at);
    for (int n = 0; n < 9; ++n) {
      const auto found = cells_.find({column + n % 3 - 1, row + n / 3 - 1});
      if (found == cells_.end()) continue;
      for (const std::size_t i : found->second) {
        const Eigen::Vector3d offset = all_[i].at - at;
        if (offset.head<2>().norm() <= within_m && std::abs(offset.z()) <= kSameFloor_m) visit(i);
      }
    }
  }

 private:
  using Cell = std::pair<std::int64_t, std::int64_t>;
  static Cell CellOf(const Eigen::Vector3d& at) {
    return {static_cast<std::int64_t>(std::floor(at.x() / kBeside_m)),
            static_cast<std::int64_t>(std::floor(at.y() / kBeside_m))};
  }

  std::span<const Seen> all_;
  std::map<Cell, std::vector<std::size_t>> cells_;
};

/// The places that age, those in most trouble first: neighbours are judged together, so that an odd
/// look is none, and beside a place that clearly ages less is enough, as of slam::Compare. A place
/// that was seen too seldom is none, nor is one that the map does not have.
std::vector<std::int32_t> AgeingPlaces(const MapUse& use, std::span<const Place> places) {
  std::vector<Seen> seen;
  for (const auto& [place, of_place] : use.places) {
    const std::int64_t num = of_place.num_found + of_place.num_refused;
    if (num == 0 || static_cast<std::size_t>(place) >= places.size()) continue;
    const Eigen::Vector3d at = places[static_cast<std::size_t>(place)].T_map_place.translation();
    seen.push_back({place, at, num, TroubleOf(of_place), 0.0});
  }
  const Grid grid(seen);
  for (Seen& one : seen) {
    std::vector<double> said;
    grid.VisitNear(one.at, kTogether_m, [&](std::size_t k) { said.push_back(seen[k].alone); });
    one.together = Median(std::move(said));
  }
  std::vector<bool> ages(seen.size(), false);
  for (const Seen& one : seen) {
    if (one.num < kMinSeen || one.together < kClear) continue;
    grid.VisitNear(one.at, kBeside_m, [&](std::size_t k) {
      if (seen[k].num >= kMinSeen && seen[k].together >= kBeside) ages[k] = true;
    });
  }
  std::vector<const Seen*> ageing;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (ages[i]) ageing.push_back(&seen[i]);
  }
  std::ranges::stable_sort(ageing,
                           [](const Seen* a, const Seen* b) { return a->alone > b->alone; });
  std::vector<std::int32_t> worst_first;
  worst_first.reserve(ageing.size());
  for (const Seen* one : ageing) worst_first.push_back(one->place);
  return worst_first;
}

constexpr std::size_t kMaxPlacesInText = 20;

std::string DayText(std::int64_t since_1970_ns) {
  if (since_1970_ns == 0) return "-";
  return absl::FormatTime("%Y-%m-%d %H:%M", absl::FromUnixNanos(since_1970_ns),
                          absl::UTCTimeZone());
}

std::string RowText(std::int32_t place, const PlaceUse& use, const Eigen::Vector3d& at) {
  const auto of_found = [num_found = use.num_found](double share) {
    return num_found == 0 ? "-" : absl::StrFormat("%.2f", share);
  };
  return absl::StrFormat("  %8d %10.1f %10.1f %7d %8d %6s %9s %7s  %s\n", place, at.x(), at.y(),
                         use.num_found, use.num_refused, of_found(use.confidence),
                         of_found(use.disagreement), of_found(use.recent_disagreement),
                         DayText(std::max(use.last_found_ns, use.last_refused_ns)));
}

}  // namespace

Json MapUseToJson(const MapUse& use) {
  Json json{{"content_id", use.content_id},
            {"since_ns", use.since_ns},
            {"until_ns", use.until_ns},
            {"num_localized", use.num_localized},
            {"num_ambiguous", use.num_ambiguous},
            {"num_not_recognized", use.num_not_recognized},
            {"num_insufficient_scan", use.num_insufficient},
            {"num_refused_nowhere", use.num_refused_nowhere},
            {"places", Json::array()}};
  for (const auto& [place, of_place] : use.places) {
    json["places"].push_back({{"place", place},
                              {"num_found", of_place.num_found},
                              {"num_refused", of_place.num_refused},
                              {"confidence", of_place.confidence},
                              {"disagreement", of_place.disagreement},
                              {"recent_disagreement", of_place.recent_disagreement},
                              {"last_found_ns", of_place.last_found_ns},
                              {"last_refused_ns", of_place.last_refused_ns}});
  }
  return json;
}

std::string MapUseAsText(const MapUse& use, std::span<const Place> places) {
  const auto num_found = std::ranges::count_if(
      use.places, [](const auto& place) { return place.second.num_found > 0; });
  std::string text = absl::StrFormat(
      "health from use, %s to %s UTC\n"
      "  answers         %d localized, %d ambiguous, %d not recognised, %d scans with too few "
      "points\n"
      "  places          %d of %d were found; %d refused queries were near none\n",
      DayText(use.since_ns), DayText(use.until_ns), use.num_localized, use.num_ambiguous,
      use.num_not_recognized, use.num_insufficient, num_found, places.size(),
      use.num_refused_nowhere);
  const std::vector<std::int32_t> rows = AgeingPlaces(use, places);
  if (rows.empty()) return text + "  no place ages, as far as was seen\n";
  absl::StrAppendFormat(&text, "  %d places age, worst first:\n", rows.size());
  absl::StrAppendFormat(&text, "  %8s %10s %10s %7s %8s %6s %9s %7s  %s\n", "place", "x", "y",
                        "found", "refused", "conf.", "disagreed", "lately", "last seen");
  for (std::size_t i = 0; i < std::min(rows.size(), kMaxPlacesInText); ++i) {
    const std::int32_t place = rows[i];
    text += RowText(place, use.places.at(place),
                    places[static_cast<std::size_t>(place)].T_map_place.translation());
  }
  if (rows.size() > kMaxPlacesInText) {
    absl::StrAppendFormat(&text, "  and %d more: --json tells all\n",
                          rows.size() - kMaxPlacesInText);
  }
  return text;
}

}  // namespace scanloc::report
