#pragma once

#include <CLI/App.hpp>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "cli/mount_options.hpp"
#include "scanloc/dataset/bag_drive.hpp"
#include "scanloc/dataset/drive.hpp"

namespace scanloc::cli {

/// Which scans of a folder to take, by their 0-based number in name order.
struct ScanSelection {
  std::size_t from = 0;
  std::optional<std::size_t> to;  ///< included; none: the last
  std::size_t every = 1;          ///< those whose number leaves `offset` when divided by this
  std::size_t offset = 0;

  void Declare(CLI::App& app);
  [[nodiscard]] absl::Status CheckUsage() const;

  [[nodiscard]] bool Takes(std::size_t i) const {
    return i >= from && i <= to.value_or(i) && i % every == offset;
  }
};

/// The items that the selection takes. InvalidArgument if it takes none of them.
template <typename Item>
[[nodiscard]] absl::StatusOr<std::vector<Item>> Select(const ScanSelection& selection,
                                                       const std::vector<Item>& items) {
  std::vector<Item> selected;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (selection.Takes(i)) selected.push_back(items[i]);
  }
  if (!selected.empty()) return selected;
  return absl::InvalidArgumentError("the selection takes none of the " +
                                    std::to_string(items.size()) +
                                    " scans; they count from 0, see --from, --to, --every and "
                                    "--offset");
}

/// Where the scans and poses of a drive lie, as options of the command line: a folder and a file,
/// or a bag.
class PoseOptions {
 public:
  /// Declares `flag` for the poses file, --calib, --times and --format. The option for the file is
  /// returned.
  CLI::Option* Declare(CLI::App& app, const char* flag, const char* what);

  /// Declares --bag, --topic, --poses-from and --no-deskew.
  void DeclareBag(CLI::App& app);

  /// Declares --T-base-sensor and what else says how the sensor is mounted; after Declare.
  void DeclareMount(CLI::App& app);
  [[nodiscard]] const SensorMount& mount() const { return mount_.mount(); }

  /// Whether there is one source of scans, a folder or a bag, and no option that needs another.
  [[nodiscard]] absl::Status CheckUsage(const std::string& scans_dir) const;
  /// And, for a folder, poses.
  [[nodiscard]] absl::Status CheckUsageWithPoses(const std::string& scans_dir) const;

  [[nodiscard]] bool has_bag() const { return !bag_.paths.empty(); }
  /// Whether the bag's poses are named.
  [[nodiscard]] bool has_bag_poses() const { return has_bag() && !bag_.poses_from.empty(); }
  /// The folder of the scans or, with a bag, its path without its extension.
  [[nodiscard]] std::string Place(const std::string& scans_dir) const;

  /// Declares options for the poses file and the calibration only; the format is recognised.
  void DeclareFiles(CLI::App& app, const std::string& poses_flag, const std::string& calib_flag);

  [[nodiscard]] const std::string& poses_file() const { return drive_.poses_file; }
  /// T_body_sensor that poses are to be read with; none without --T-base-sensor.
  [[nodiscard]] std::optional<Pose> T_body_sensor() const;

  /// The scans of the folder or the bag. Notes are written to stderr.
  [[nodiscard]] absl::StatusOr<std::vector<dataset::ScanFile>> ListScans(
      const std::string& scans_dir) const;

  /// The drive of the scans in the folder with these poses, or that of the bag. Its notes are
  /// written to stderr. With --T-base-sensor the poses given are taken for those of the base.
  [[nodiscard]] absl::StatusOr<dataset::Drive> OpenDrive(const std::string& scans_dir) const;

  /// The poses alone, in the order of the file.
  [[nodiscard]] absl::StatusOr<dataset::Trajectory> ReadTrajectory() const;

 private:
  dataset::DriveOptions drive_;   // without scans_dir and format
  dataset::BagDriveOptions bag_;  // without calib_file
  MountOptions mount_;
  std::string format_ = "auto";
  CLI::Option* poses_option_ = nullptr;
  CLI::Option* calib_option_ = nullptr;
};

/// The name of a session that was given none: the folder's, or the one above folders that datasets
/// keep their scans in, such as `velodyne` or `sensor_data/Ouster`.
[[nodiscard]] std::string DefaultSessionName(const std::string& scans_dir);

}  // namespace scanloc::cli
