#pragma once

#include "messages.hpp"
#include "scanloc/core/answer.hpp"

namespace scanloc::ros2 {

/// How far the pose of a localized answer may be off.
///
/// An answer that is localized is right within 1 m and 10° (docs/algorithm.md); half of either is
/// told as standard deviation, in every direction, which is more than registration leaves.
[[nodiscard]] Covariance CovarianceOf(const Candidate& candidate);

}  // namespace scanloc::ros2
