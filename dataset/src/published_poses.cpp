#include "published_poses.hpp"

#include <array>
#include <cstddef>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dataset_frames.hpp"
#include "pose_rows.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

// A body in a world of x north, y east, z down, as the sensor at this place of the body in a world
// of z up.
absl::StatusOr<Pose> PoseFromDownward(const Eigen::Vector3d& position_m,
                                      const Eigen::Vector3d& roll_pitch_yaw_rad,
                                      const Eigen::Vector3d& sensor_m) {
  Eigen::Matrix<double, 3, 4> matrix;
  matrix << RotationOf(roll_pitch_yaw_rad), position_m;
  ASSIGN_OR_RETURN(const Pose T_world_body, PoseFromMatrix(matrix));
  return Pose(Upward() * T_world_body * Eigen::Translation3d(sensor_m) * Upward());
}

}  // namespace

absl::StatusOr<Pose> ParseNclt(std::span<const std::string_view> tokens) {
  ASSIGN_OR_RETURN(const auto values, ParseValues<6>(tokens));
  const auto& [x, y, z, roll, pitch, yaw] = values;
  return PoseFromDownward({x, y, z}, {roll, pitch, yaw}, kNcltSensor_m);
}

// northing, easting and down are columns 5 to 7, roll, pitch and yaw 12 to 14.
absl::StatusOr<Pose> ParseOxford(std::span<const std::string_view> tokens) {
  ASSIGN_OR_RETURN(const auto position, ParseValues<3>(tokens.subspan(5, 3)));
  ASSIGN_OR_RETURN(const auto turn, ParseValues<3>(tokens.subspan(12, 3)));
  static const Eigen::Vector3d kSensor_m = OxfordSensor_m();
  return PoseFromDownward(Eigen::Vector3d(position.data()), Eigen::Vector3d(turn.data()),
                          kSensor_m);
}

absl::Status CheckOxfordHeader(const Tokens& row) {
  static constexpr std::array<std::pair<std::size_t, std::string_view>, 8> kColumns = {
      {{0, "timestamp"},
       {1, "ins_status"},
       {5, "northing"},
       {6, "easting"},
       {7, "down"},
       {12, "roll"},
       {13, "pitch"},
       {14, "yaw"}}};
  for (const auto& [column, name] : kColumns) {
    if (column >= row.size() || row[column] != name) {
      return Invalid(absl::StrCat("column ", column + 1, " of the header is not ", ToAbsl(name),
                                  ", as that of ins.csv is"));
    }
  }
  return absl::OkStatus();
}

bool IsGoodOxfordSolution(std::span<const std::string_view> tokens) {
  return tokens[1] == "INS_SOLUTION_GOOD";
}

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
