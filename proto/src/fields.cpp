#include "fields.hpp"

#include <cmath>

#include "absl/strings/str_cat.h"

namespace scanloc::proto {

absl::Status CheckLength(absl::string_view field, const std::string& text, std::size_t max_bytes) {
  if (text.size() <= max_bytes) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " has ", text.size(), " bytes; at most ", max_bytes, " are allowed"));
}

absl::Status CheckFinite(absl::string_view field, double value) {
  if (std::isfinite(value)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", value, "; it must be a finite number"));
}

absl::Status CheckRange(absl::string_view field, double value, double low, double high) {
  if (value >= low && value <= high) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", value, "; it must lie in [", low, ", ", high, "]"));
}

absl::StatusOr<Pose> PoseFromProto(absl::string_view field, const v1::Pose& message) {
  if (message.matrix_size() != 12) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, " has ", message.matrix_size(), " numbers; it must have 12"));
  }
  Eigen::Matrix<double, 3, 4> matrix;
  for (int i = 0; i < 12; ++i) matrix(i / 4, i % 4) = message.matrix(i);
  // Only the verdict is taken: the nearest rotation need not be the same bits.
  if (const auto pose = PoseFromMatrix(matrix); !pose.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(field, ": ", pose.status().message()));
  }
  Pose pose = Pose::Identity();
  pose.matrix().topRows<3>() = matrix;
  return pose;
}

v1::Pose PoseToProto(const Pose& pose) {
  v1::Pose message;
  message.mutable_matrix()->Reserve(12);
  for (int i = 0; i < 12; ++i) message.add_matrix(pose.matrix()(i / 4, i % 4));
  return message;
}

}  // namespace scanloc::proto
