#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "scanloc/core/scan/pose.hpp"

namespace scanloc {

/// The indices of the poses to keep for equidistant places (paper, Sec. VI): the first, and then
/// each that lies spacing_m or more from the last one kept. Length of path does not count: at a
/// standstill it grows by the noise of the poses. Up to a millimetre less is enough, for positions
/// rounded in a text file. A spacing_m of 0 or less keeps all.
[[nodiscard]] std::vector<std::size_t> SelectBySpacing(std::span<const Pose> poses,
                                                       double spacing_m);

}  // namespace scanloc
