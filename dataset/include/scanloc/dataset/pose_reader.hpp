#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/pose.hpp"

namespace scanloc::dataset {

enum class PoseFormat {
  kAuto,    ///< told by the number of values in the first row
  kKitti,   ///< 12 values a row: [R t] row by row, no stamp
  kTum,     ///< stamp [s] tx ty tz qx qy qz qw; lines that begin with # are comments
  kMulran,  ///< global_pose.csv: stamp [ns],12 values as of KITTI, between commas
  kNclt,    ///< groundtruth_DATE.csv: stamp [µs],x,y,z,roll,pitch,yaw of the robot, z down
  kOxford,  ///< ins.csv of Oxford Radar RobotCar, with its header: stamp [µs], NED, z down
};

/// Parses `auto`, `kitti`, `tum`, `mulran`, `nclt` or `oxford`; InvalidArgument for other names.
[[nodiscard]] absl::StatusOr<PoseFormat> ParsePoseFormat(std::string_view name);

/// Its name, as above.
[[nodiscard]] std::string_view PoseFormatName(PoseFormat format);

/// The poses of a drive, in the order of the file.
struct Trajectory {
  PoseFormat format = PoseFormat::kKitti;  ///< never kAuto
  std::vector<Pose> T_map_sensor;
  std::vector<std::int64_t> stamps_ns;  ///< one a pose; empty for kKitti
};

/// Reads a trajectory.
///
/// Without calib_file the rows are taken as T_map_sensor. With it, they are the poses of another
/// body (KITTI: the left grey camera; MulRan: the vehicle) and its `Tr:` row is T_body_sensor:
///   kKitti          T_map_sensor = Tr⁻¹ · T_row · Tr. The rows' own world is a camera frame, z
///                   forward; the map frame becomes the sensor frame where the camera's pose is the
///                   identity, that is the sensor frame of the first scan, z up.
///   others          T_map_sensor = T_row · Tr. The map frame is the world of the rows.
///
/// Rows of kNclt and kOxford become x forward, y left, z up (their worlds north, west, up) of the
/// sensor that ReadScan gives scans of these datasets for. Of kNclt, rows with NaN are left out.
/// Oxford's INS is taken for the vehicle's origin: the arm between them is not applied.
///
/// NotFound: no such file. InvalidArgument, with file, line and value: a number that does not
/// parse, a wrong number of values, NaN, a rotation that is none, a translation out of range, a
/// blank line between rows, or no row at all.
[[nodiscard]] absl::StatusOr<Trajectory> ReadTrajectory(const std::string& poses_file,
                                                        PoseFormat format = PoseFormat::kAuto,
                                                        const std::string& calib_file = "");

/// Reads the `Tr:` row (12 values) of a calibration file as that of the KITTI odometry benchmark:
/// T_camera_sensor. Errors as of ReadTrajectory.
[[nodiscard]] absl::StatusOr<Pose> ReadCalib(const std::string& calib_file);

/// Reads times in seconds, one a line, into nanoseconds, without the rounding of a double.
/// Errors as of ReadTrajectory.
[[nodiscard]] absl::StatusOr<std::vector<std::int64_t>> ReadTimes(const std::string& times_file);

}  // namespace scanloc::dataset
