#pragma once

#include <span>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "pose_rows.hpp"
#include "scanloc/core/scan/pose.hpp"

/// Rows of datasets whose frames are x forward, y right, z down, as poses of the sensor that their
/// scans are given for, z up.
namespace scanloc::dataset {

/// x, y, z, roll, pitch, yaw of NCLT's robot. Requires 6 tokens.
[[nodiscard]] absl::StatusOr<Pose> ParseNclt(std::span<const std::string_view> tokens);

/// A whole row of Oxford's ins.csv. Requires 15 tokens.
[[nodiscard]] absl::StatusOr<Pose> ParseOxford(std::span<const std::string_view> tokens);

/// InvalidArgument if a column that is read has another name.
[[nodiscard]] absl::Status CheckOxfordHeader(const Tokens& row);

/// Whether a row of ins.csv holds a solution that the INS vouches for. Requires 2 tokens.
[[nodiscard]] bool IsGoodOxfordSolution(std::span<const std::string_view> tokens);

}  // namespace scanloc::dataset
