#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/dataset/drive.hpp"

namespace scanloc::dataset {

/// Farthest apart that two poses may lie in time for one between them to be taken [ns].
inline constexpr std::int64_t kMaxPoseGap_ns = 1'000'000'000;

/// A drive in a bag; empty: not given.
struct BagDriveOptions {
  std::vector<std::string> paths{};  ///< files or folders, as for Bag::Open
  std::string topic{};               ///< of the clouds; may be left out where there is one
  /// A topic of nav_msgs/Odometry, geometry_msgs/PoseStamped, PoseWithCovarianceStamped or
  /// TransformStamped, or "tf:PARENT" for the sensor's frame in another by TF, "tf:PARENT:BODY"
  /// for that of a body with a mount; may be left out where there is one topic.
  std::string poses_from{};
  std::string calib_file{};  ///< the mount on the body of the poses, in place of tf_static
  bool deskew = true;        ///< take motion out where points have times
  /// The mount on the body of the poses, in place of tf_static and calib_file; poses that are the
  /// sensor's own by the names of frames or by TF need none.
  std::optional<Pose> T_body_sensor{};
};

/// Opens the drive: each cloud has the pose at its stamp, interpolated between the two around it.
///
/// Poses of a body other than the sensor get the mount that tf_static gives, or calib_file. Clouds
/// without a pose are left out and counted, and the longest gap is told. With `deskew`, points are
/// moved to where they would be seen at the stamp of their cloud.
///
/// Errors as of Bag::Open. InvalidArgument too, with the topics there are: no such topic, of
/// another type, or several to choose from; clouds of several frames (those that name none are left
/// out beside others, and counted); transforms that do not connect; or no cloud with a pose.
[[nodiscard]] absl::StatusOr<Drive> OpenBagDrive(const BagDriveOptions& options);

/// The clouds alone. Motion is taken out by the poses, if they are given or there is one topic of
/// them that can be used. Notes are added to `notes`.
[[nodiscard]] absl::StatusOr<std::vector<ScanFile>> ListBagScans(const BagDriveOptions& options,
                                                                 std::vector<std::string>& notes);

}  // namespace scanloc::dataset
