#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc::dataset {

/// The pose of the sensor at a time [ns], if it is known.
using PoseAt = std::function<std::optional<Pose>(std::int64_t stamp_ns)>;

/// Moves each point from where the sensor saw it, offsets_s after the stamp, to where it would have
/// seen it at the stamp. Requires an offset a point. Leaves the points as they are and returns
/// false if a pose within the sweep is not known.
[[nodiscard]] bool Deskew(const PoseAt& pose_at, std::int64_t stamp_ns,
                          const std::vector<float>& offsets_s, PointCloud& points);

}  // namespace scanloc::dataset
