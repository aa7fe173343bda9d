#pragma once

#include <span>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "pose_rows.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/dataset/pose_reader.hpp"

/// What makes the poses of published datasets those of the sensor that their scans are given for.
namespace scanloc::dataset {

/// What is done to the rows of a format to make them poses of the sensor.
struct PoseMount {
  Pose T_body_sensor = Pose::Identity();
  std::string note;           ///< a sentence without an end
  bool is_of_format = false;  ///< done without being asked for
};

/// The calibration.json in one of the four folders above the poses; empty if there is none.
[[nodiscard]] std::string FindNaverCalib(const std::string& poses_file);

/// The mount in calib_file if that is given, else what the format takes.
[[nodiscard]] absl::StatusOr<PoseMount> FindMount(PoseFormat format, const std::string& calib_file,
                                                  const std::string& naver_calib);

/// x, y, z, roll, pitch, yaw of NCLT's robot, z down, as a pose of its sensor, z up. Requires 6
/// tokens.
[[nodiscard]] absl::StatusOr<Pose> ParseNclt(std::span<const std::string_view> tokens);

/// The same of a whole row of Oxford's ins.csv. Requires 15 tokens.
[[nodiscard]] absl::StatusOr<Pose> ParseOxford(std::span<const std::string_view> tokens);

/// InvalidArgument if a column that is read has another name.
[[nodiscard]] absl::Status CheckOxfordHeader(const Tokens& row);

/// Whether a row of ins.csv holds a solution that the INS vouches for. Requires 2 tokens.
[[nodiscard]] bool IsGoodOxfordSolution(std::span<const std::string_view> tokens);

}  // namespace scanloc::dataset
