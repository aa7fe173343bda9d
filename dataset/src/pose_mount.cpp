#include "pose_mount.hpp"

#include <filesystem>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "dataset_frames.hpp"
#include "pose_rows.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {

// NAVER LABS: calibration.json stands above the sequences, ROOT/pangyo/train/lidars/poses.txt.
std::string FindNaverCalib(const std::string& poses_file) {
  constexpr int kLevels = 4;
  std::error_code error;
  std::filesystem::path folder = std::filesystem::absolute(poses_file, error).parent_path();
  for (int level = 0; level < kLevels && !error; ++level, folder = folder.parent_path()) {
    const std::filesystem::path calib = folder / "calibration.json";
    if (std::filesystem::is_regular_file(calib, error)) return calib.string();
    error.clear();
  }
  return "";
}

absl::StatusOr<PoseMount> FindMount(PoseFormat format, const std::string& calib_file,
                                    const std::string& naver_calib) {
  const std::string& calib =
      calib_file.empty() && format == PoseFormat::kNaver ? naver_calib : calib_file;
  if (!calib.empty()) {
    ASSIGN_OR_RETURN(const Pose T_body_sensor, ReadCalib(calib));
    return PoseMount{T_body_sensor, absl::StrCat("the mount in ", calib, " is applied"),
                     calib_file.empty()};
  }
  switch (format) {
    case PoseFormat::kMulran:
      return PoseMount{
          MulranOuster(),
          "the rows are the vehicle's, and the published mount of its Ouster is applied "
          "(1.7042 m ahead, 1.8047 m up, looking back); if they are the sensor's own, give "
          "--calib a file with the row \"Tr: 1 0 0 0 0 1 0 0 0 0 1 0\"",
          true};
    case PoseFormat::kNclt:
      return PoseMount{
          Pose::Identity(),
          "the rows are the robot's, z down: y and z are negated, and the place of its "
          "HDL-32E, 0.957 m above it, is added",
          true};
    case PoseFormat::kOxford:
      return PoseMount{Pose::Identity(),
                       "the rows are the INS's, z down: y and z are negated, and the place of the "
                       "sensors on the vehicle is added",
                       true};
    case PoseFormat::kNaver:
      return Invalid(
          "its rows are NAVER LABS's, poses of the vehicle, but there is no "
          "calibration.json in the folders above; give it as --calib");
    case PoseFormat::kMatrix:
      return PoseMount{.note =
                           "the rows are taken for poses of the sensor; NAVER LABS's are the "
                           "vehicle's and need its calibration.json as --calib"};
    case PoseFormat::kKitti360:
      return PoseMount{.note =
                           "the rows are taken for poses of the sensor; KITTI-360's own are of its "
                           "IMU or a camera and need --calib"};
    default:
      return PoseMount{.note = "the rows are taken for poses of the sensor"};
  }
}

}  // namespace scanloc::dataset
