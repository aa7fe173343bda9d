#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "pose_rows.hpp"
#include "scanloc/dataset/pose_reader.hpp"

namespace scanloc::dataset {

/// Rows of 4x4 matrices, each in one line of 16 values or in four of 4.
class MatrixRows {
 public:
  /// Appends a pose to the trajectory, of kNaver or kMatrix, when its last value is there.
  [[nodiscard]] absl::Status Append(const Tokens& row, Trajectory& trajectory);

  /// Appends the stamps, if kMatrix has them where the 1 of a matrix stands.
  [[nodiscard]] absl::Status Finish(Trajectory& trajectory) const;

 private:
  Eigen::Matrix4d values_ = Eigen::Matrix4d::Zero();
  std::size_t num_values_ = 0;  // read so far
  bool are_corners_one_ = true;
  std::vector<std::string> corners_;  // last value of each matrix, as written
};

}  // namespace scanloc::dataset
