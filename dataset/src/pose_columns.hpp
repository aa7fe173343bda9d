#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "pose_rows.hpp"

namespace scanloc::dataset {

/// Where the values of a pose with a quaternion stand in a row.
struct PoseColumns {
  std::array<std::size_t, 3> xyz{};         ///< position
  std::array<std::size_t, 4> quaternion{};  ///< x y z w
  std::vector<std::size_t> stamp;           ///< none; one; or whole seconds and nanoseconds
  std::size_t num_values = 0;               ///< in a row
};

/// The columns that a headline names, such as "timestamp tx ty tz qx qy qz qw",
/// "#sec,nsec,x,y,...", EuRoC's "p_RS_R_x [m]" or a recorded topic's "pose.orientation.w". None
/// unless each part of position and quaternion is named once.
[[nodiscard]] std::optional<PoseColumns> ReadHeadline(const Tokens& headline);

}  // namespace scanloc::dataset
