#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/dataset/pose_reader.hpp"

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

}  // namespace scanloc::dataset
