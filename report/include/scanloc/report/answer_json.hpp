#pragma once

#include <optional>

#include "scanloc/core/answer.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/report/json.hpp"

/// How documents tell of an answer, whoever writes them.
namespace scanloc::report {

/// x, y, z [m], and qx, qy, qz, qw with qw not negative.
[[nodiscard]] Json PoseToJson(const Pose& pose);

/// latitude, longitude [deg], altitude_m, and heading_deg, clockwise from true north.
[[nodiscard]] Json GeoToJson(const GeoPose& geo);
/// Likewise, and anchor_m: the point of the map frame that is there.
[[nodiscard]] Json GeoToJson(const GeoOrigin& origin);

/// outcome, reason and candidates, with their errors where the truth is given.
[[nodiscard]] Json AnswerToJson(const Answer& answer,
                                const std::optional<Pose>& T_map_true = std::nullopt);

}  // namespace scanloc::report
