#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc::dataset {

enum class PoseFormat {
  kAuto,      ///< told by the first row, and said in a note
  kKitti,     ///< 12 values a row: [R t] row by row, no stamp
  kTum,       ///< stamp tx ty tz qx qy qz qw, or the columns that a headline names
  kMulran,    ///< global_pose.csv: stamp [ns],12 values as of KITTI, between commas, of the vehicle
  kNclt,      ///< groundtruth_DATE.csv: stamp [µs],x,y,z,roll,pitch,yaw of the robot, z down
  kOxford,    ///< ins.csv of Oxford Radar RobotCar, with its header: stamp [µs], NED, z down
  kNaver,     ///< NAVER LABS: 4x4 matrices of the vehicle, 16 values a row or 4 rows of 4, no stamp
  kMatrix,    ///< likewise, of the sensor; the last value is 1, or in all the time (BALM)
  kKitti360,  ///< the number of a frame, and 12 values as of KITTI or a 4x4 matrix
};

/// Parses `auto`, `kitti`, `tum`, `mulran`, `nclt`, `oxford`, `naver`, `matrix` or `kitti360`;
/// InvalidArgument for other names.
[[nodiscard]] absl::StatusOr<PoseFormat> ParsePoseFormat(std::string_view name);

/// Its name, as above.
[[nodiscard]] std::string_view PoseFormatName(PoseFormat format);

/// The poses of a drive, in the order of the file.
struct Trajectory {
  PoseFormat format = PoseFormat::kKitti;  ///< never kAuto
  std::vector<Pose> T_map_sensor;
  std::vector<std::int64_t> stamps_ns;      ///< one a pose; empty if the rows have none
  std::vector<std::int64_t> frame_numbers;  ///< kKitti360: one a pose
  std::size_t num_left_out = 0;  ///< rows that hold no usable pose, as ReadTrajectory says
  /// What a user should know of how the file was read: sentences without an end.
  std::vector<std::string> notes;
};

/// Reads a trajectory.
///
/// kAuto goes by the number of values in a row, and where that leaves a choice by what is typical
/// of a format: kMulran has stamps of 19 digits between commas, kNclt of 16, kNaver a
/// calibration.json nearby. Seven to nine values with a quaternion of length 1 are kTum: without a
/// stamp, with one, or with whole seconds and nanoseconds; position first or quaternion first, w
/// last or first, whichever makes a sensor that stands upright. A first row without a number is a
/// headline, and a comment above the rows can be one: if it names x y z qx qy qz qw, with prefixes
/// or not, kTum has the columns that it names. What was chosen, if it is not kKitti, and what was
/// done to the rows is a note; so is the latter for a format that was asked for.
///
/// Stamps are in the unit that makes the first one a date of our days: 10 digits before the point
/// are seconds, 13 milliseconds, 16 microseconds, 19 nanoseconds.
///
/// With calib_file the rows are the poses of another body (KITTI: the left grey camera; MulRan and
/// NAVER LABS: the vehicle) and it gives T_body_sensor:
///   kKitti          T_map_sensor = T_body_sensor⁻¹ · T_row · T_body_sensor. The rows' own world is
///                   a camera frame, z forward; the map frame becomes the sensor frame where the
///                   camera's pose is the identity, that is the sensor frame of the first scan, z
///                   up.
///   others          T_map_sensor = T_row · T_body_sensor. The map frame is the world of the rows.
/// With T_body_sensor, T_map_sensor = T_row · T_body_sensor for all, and calib_file is not looked
/// at. Without either, kMulran takes the published mount of the Ouster, kNaver the calibration.json
/// in one of the four folders above the file, and the rows of the others are T_map_sensor.
///
/// Rows of kNclt and kOxford become x forward, y left, z up (their worlds north, west, up) of the
/// sensor that ReadScan gives scans of these datasets for. Left out and counted are rows of kNclt
/// with NaN, and of kOxford whose ins_status is not INS_SOLUTION_GOOD.
///
/// NotFound: no such file. InvalidArgument, with file, line and value: a number that does not
/// parse, a wrong number of values, NaN, a rotation that is none, a translation out of range, a
/// blank line between rows, no row at all, no calibration.json, or a format that cannot be told.
[[nodiscard]] absl::StatusOr<Trajectory> ReadTrajectory(
    const std::string& poses_file, PoseFormat format = PoseFormat::kAuto,
    const std::string& calib_file = "", const std::optional<Pose>& T_body_sensor = std::nullopt);

/// Whether the body of the poses moves along its own z, as the cameras of KITTI do and no LiDAR
/// whose z is up. False if it moves less than a metre.
[[nodiscard]] bool MovesLikeACamera(const Trajectory& trajectory);

/// Reads T_body_sensor: the `Tr:` row (12 values) of a calibration file as that of the KITTI
/// odometry benchmark, or "Lidar" of "Extrinsic" (4x4) of NAVER LABS's calibration.json. Errors as
/// of ReadTrajectory.
[[nodiscard]] absl::StatusOr<Pose> ReadCalib(const std::string& calib_file);

/// Reads times, one a line, into nanoseconds, without the rounding of a double. Their unit is told
/// as that of stamps. Errors as of ReadTrajectory.
[[nodiscard]] absl::StatusOr<std::vector<std::int64_t>> ReadTimes(const std::string& times_file);

}  // namespace scanloc::dataset
