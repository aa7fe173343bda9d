#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/dataset/pose_reader.hpp"
#include "scanloc/dataset/scan_reader.hpp"

namespace scanloc::dataset {

/// The scan files (.bin, .npy, .pcd, .ply; hidden files left out) of a folder, by name: the numbers
/// in names count as numbers, what stands between by its bytes.
///
/// If the folder holds none of them, the files of the first of these folders in it that holds some
/// are listed: `velodyne` (a KITTI sequence), `Scans`, `Ouster`, `sensor_data/Ouster` (MulRan),
/// `lidars`, `train/lidars` (NAVER LABS). A folder velodyne_sync, named or inside, is NCLT's;
/// folders velodyne_left and velodyne_right inside are Oxford Radar RobotCar's: left scans whose
/// nearest right one is no more than kMaxPartnerGap_ns off, with that one. NotFound: no such
/// folder. InvalidArgument: not a folder, or no scan in it.
[[nodiscard]] absl::StatusOr<std::vector<ScanFile>> ListScans(const std::string& scans_dir);

/// Half a turn of a sensor at 20 Hz, and some [ns].
inline constexpr std::int64_t kMaxPartnerGap_ns = 30'000'000;

/// Where a drive lies; empty: not given.
struct DriveOptions {
  std::string scans_dir{};   ///< as for ListScans
  std::string poses_file{};  ///< as for ReadTrajectory
  std::string calib_file{};  ///< T_body_sensor, as for ReadTrajectory; optional
  std::string times_file{};  ///< when each scan was taken, one line a scan; optional
  PoseFormat format = PoseFormat::kAuto;
  /// The poses are of this body, in place of any that a format or calib_file says.
  std::optional<Pose> T_body_sensor{};
};

/// One scan of a drive, not read yet, and where it was taken.
struct Frame {
  std::string path{};
  std::string name{};  ///< the file's name without its folder
  Pose T_map_sensor = Pose::Identity();
  std::int64_t stamp_ns = 0;  ///< of the scan, else of its pose; 0 if neither is known
  ScanLayout layout = ScanLayout::kByExtension;
  std::string partner_path{};  ///< as in ScanFile, and so are these
  std::shared_ptr<const ScanStore> store{};
  std::size_t index = 0;

  [[nodiscard]] ScanFile file() const { return {path, name, layout, partner_path, store, index}; }
};

/// A recorded drive, in the name order of its scans.
struct Drive {
  std::vector<Frame> frames;
  /// Scans left out because no pose has their number or lies within kMaxStampGap_ns.
  std::size_t num_without_pose = 0;
  /// What a user should know of how the drive was read: sentences without an end.
  std::vector<std::string> notes;
};

/// Farthest in time that a pose may lie from the scan it is paired with [ns]: one turn of a sensor
/// at 10 Hz.
inline constexpr std::int64_t kMaxStampGap_ns = 100'000'000;

/// Opens a drive: lists its scans and pairs each with a pose.
///
/// The i-th scan by name has the i-th pose, and their numbers must agree. Where both have stamps,
/// each scan has the pose nearest in time instead; where poses have the numbers of frames and scans
/// a number each, that decides. Poses have stamps as Trajectory says; scans have those of
/// times_file (4x4 matrices: else of timestamps.txt beside the poses), else those that all their
/// names give: 19 digits [ns], 16 digits [µs], seconds with a decimal point, or seconds and whole
/// nanoseconds after "_", "-" or a point.
///
/// KITTI's poses without calib_file are those of a camera if MovesLikeACamera says so: then the
/// calib.txt in the folder of the scans or the one above is used, and a note says so, or that there
/// is none.
///
/// Errors as of ListScans, ReadTrajectory and ReadTimes. InvalidArgument too: numbers of scans,
/// poses or times that differ (both are named); names that can be ordered in two ways; times that
/// fall where scans and poses are paired in order; stamps that scans and poses hardly have in
/// common, or that poses share which differ; or not one scan that has a pose.
[[nodiscard]] absl::StatusOr<Drive> OpenDrive(const DriveOptions& options);

}  // namespace scanloc::dataset
