#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "scanloc/core/map/map.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/eval/recall_distribution.hpp"

/// What is true of a query (paper, Sec. "Correctness Criteria"). Pure functions; thread-safe.
namespace scanloc::eval {

/// Distance in the plane [m].
[[nodiscard]] double PlanarDistance_m(const Pose& a, const Pose& b);

/// Between the two headings, in [0, 180].
[[nodiscard]] double HeadingDifference_deg(const Pose& a, const Pose& b);

/// One a place: true where a query does not see it, as it was not mapped before that time; a map
/// that grows is so looked at as it was. Empty where no time is given: all are seen.
[[nodiscard]] std::vector<bool> HiddenPlaces(std::span<const Place> places,
                                             std::optional<std::int64_t> sees_until_ns);

/// How the query differs from the nearest place that it sees, of equally near ones the first; none
/// where it sees none. `hidden` as HiddenPlaces gives it.
[[nodiscard]] std::optional<RevisitVariance> NearestPlace(std::span<const Place> places,
                                                          const std::vector<bool>& hidden,
                                                          const Pose& T_map_true);

/// A query is a revisit if the nearest place that it sees lies no farther than within_m.
[[nodiscard]] bool IsRevisit(const std::optional<RevisitVariance>& nearest, double within_m);

}  // namespace scanloc::eval
