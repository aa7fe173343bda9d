#include "matrix_rows.hpp"

#include <optional>
#include <span>

#include "absl/strings/str_cat.h"
#include "decimal_time.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {

absl::Status MatrixRows::Append(const Tokens& row, Trajectory& trajectory) {
  constexpr std::size_t kMatrix = 16;
  constexpr std::size_t kLine = 4;
  const bool fits = row.size() == kLine || (row.size() == kMatrix && num_values_ == 0);
  if (!fits) return CheckNumValues(row, num_values_ == 0 ? kMatrix : kLine);
  for (const std::string_view token : row) {
    ASSIGN_OR_RETURN(const auto value, ParseValues<1>(std::span(&token, 1)));
    values_(static_cast<Eigen::Index>(num_values_ / kLine),
            static_cast<Eigen::Index>(num_values_ % kLine)) = value.front();
    ++num_values_;
  }
  if (num_values_ < kMatrix) return absl::OkStatus();
  num_values_ = 0;
  if (trajectory.format == PoseFormat::kMatrix) {
    corners_.emplace_back(row.back());
    are_corners_one_ &= values_(3, 3) == 1.0;
    values_(3, 3) = 1.0;
  }
  ASSIGN_OR_RETURN(const Pose pose, PoseFromHomogeneous(values_));
  trajectory.T_map_sensor.push_back(pose);
  return absl::OkStatus();
}

absl::Status MatrixRows::Finish(Trajectory& trajectory) const {
  if (num_values_ != 0) return Invalid("ends within a matrix; 4x4 ones have 16 values");
  if (are_corners_one_) return absl::OkStatus();
  const TimeUnit unit = LikelyUnit(corners_.front());
  for (const std::string& corner : corners_) {
    const std::optional<std::int64_t> ns = ParseTimeAsNs(corner, unit);
    const std::vector<std::int64_t>& stamps_ns = trajectory.stamps_ns;
    if (!ns || (!stamps_ns.empty() && *ns <= stamps_ns.back())) {
      return Invalid(absl::StrCat("the last row of matrix ", stamps_ns.size(),
                                  " is not 0 0 0 1, and ", Quote(corner),
                                  " is no time later than that of the matrix before"));
    }
    trajectory.stamps_ns.push_back(*ns);
  }
  return absl::OkStatus();
}

}  // namespace scanloc::dataset
