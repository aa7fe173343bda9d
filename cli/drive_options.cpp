#include "cli/drive_options.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <iostream>
#include <string_view>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::cli {

namespace {

constexpr double kMaxScan = 1e9;

void WriteNotes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) std::cerr << "scanloc: note: " << Printable(note) << '\n';
}

}  // namespace

void ScanSelection::Declare(CLI::App& app) {
  const OptionGroup group(app, "Which scans of the folder, counted from 0 in name order");
  app.add_option("--from", from, "First scan")->check(InRange(0, kMaxScan));
  app.add_option("--to", to, "Last scan, which is taken too [the last of the folder]")
      ->check(InRange(0, kMaxScan));
  app.add_option("--every", every, "Only each N-th scan")->check(InRange(1, kMaxScan));
  app.add_option("--offset", offset, "With --every N: the scans whose number modulo N is this")
      ->check(InRange(0, kMaxScan));
}

absl::Status ScanSelection::CheckUsage() const {
  if (offset >= every) {
    return absl::InvalidArgumentError(
        absl::StrCat("--offset is ", offset, "; it must be less than --every, which is ", every));
  }
  if (to.has_value() && *to < from) {
    return absl::InvalidArgumentError(
        absl::StrCat("--to is ", *to, "; it must not be less than --from, which is ", from));
  }
  return absl::OkStatus();
}

CLI::Option* PoseOptions::Declare(CLI::App& app, const char* flag, const char* what) {
  CLI::Option* poses = app.add_option(flag, drive_.poses_file, what)->type_name("FILE");
  poses_option_ = poses;
  app.add_option("--format", format_,
                 "Format of the poses: auto, which says what it took, kitti (12 numbers a row), "
                 "mulran (global_pose.csv), tum, nclt (groundtruth_*.csv), oxford (ins.csv), naver "
                 "(4x4 matrices of the vehicle), matrix (of the sensor) or kitti360")
      ->check(ParsedBy(&dataset::ParsePoseFormat))
      ->needs(poses);
  calib_option_ =
      app.add_option(
             "--calib", drive_.calib_file,
             "Calibration that maps sensor points to the body that the poses are of: a file with "
             "a row Tr:, or NAVER LABS's calibration.json [KITTI, NAVER LABS: looked for near "
             "the scans; MulRan: the published mount of its Ouster; a bag: tf_static]")
          ->type_name("FILE")
          ->needs(poses);
  app.add_option(
         "--times", drive_.times_file,
         "When each scan was taken: a line a scan [s, ms, us or ns, by its digits]; 4x4 matrices: "
         "timestamps.txt beside the poses, if this is not given")
      ->type_name("FILE")
      ->needs(poses);
  return poses;
}

void PoseOptions::DeclareBag(CLI::App& app) {
  const OptionGroup group(app, "Scans from a bag, in place of a folder");
  calib_option_->remove_needs(poses_option_);  // a bag may need it, too
  auto* bag = app.add_option("--bag", bag_.paths,
                             "Bag with point clouds: MCAP, rosbag2's folder or .db3, or ROS 1's "
                             ".bag; several are read as one")
                  ->type_name("FILE|DIR");
  app.add_option("--topic", bag_.topic,
                 "Topic of the point clouds [the only one; `scanloc bag FILE` lists them]")
      ->needs(bag);
  app.add_option("--poses-from", bag_.poses_from,
                 "Topic of odometry or poses, or tf:FRAME for poses in that frame by TF, of the "
                 "sensor, or with :BODY of what carries it [the only topic of poses]")
      ->needs(bag)
      ->type_name("TOPIC|tf:FRAME[:BODY]");
  app.add_flag("--deskew,!--no-deskew", bag_.deskew,
               "Take the motion during a sweep out of it, where points have times and the bag "
               "poses [yes]");
}

void PoseOptions::DeclareMount(CLI::App& app) { mount_.Declare(app)->excludes(calib_option_); }

std::optional<Pose> PoseOptions::T_body_sensor() const {
  return mount_.has_base() ? std::optional(mount().T_base_sensor) : std::nullopt;
}

absl::Status PoseOptions::CheckUsage(const std::string& scans_dir) const {
  if (scans_dir.empty() == !has_bag()) {
    return absl::InvalidArgumentError("scans come from --scans or from --bag; give one of both");
  }
  if (has_bag() && !drive_.times_file.empty()) {
    return absl::InvalidArgumentError("--times is for scans of a folder; a bag has its own");
  }
  if (!drive_.calib_file.empty() && poses_file().empty() && !has_bag()) {
    return absl::InvalidArgumentError("--calib is for poses, and none are given");
  }
  return absl::OkStatus();
}

absl::Status PoseOptions::CheckUsageWithPoses(const std::string& scans_dir) const {
  RETURN_IF_ERROR(CheckUsage(scans_dir));
  if (poses_file().empty() != has_bag()) {
    return absl::InvalidArgumentError(has_bag() ? "the poses of a bag are its own; leave out "
                                                  "--poses, see --poses-from"
                                                : "--poses is required");
  }
  return absl::OkStatus();
}

std::string PoseOptions::Place(const std::string& scans_dir) const {
  if (!has_bag()) return scans_dir;
  std::filesystem::path path = bag_.paths.front();
  for (const char* extension : {".zstd", ".mcap", ".db3", ".bag"}) {
    if (path.extension() == extension) path.replace_extension();
  }
  return path.string();
}

absl::StatusOr<std::vector<dataset::ScanFile>> PoseOptions::ListScans(
    const std::string& scans_dir) const {
  if (!has_bag()) return dataset::ListScans(scans_dir);
  dataset::BagDriveOptions options = bag_;
  options.calib_file = drive_.calib_file;
  options.T_body_sensor = T_body_sensor();
  std::vector<std::string> notes;
  absl::StatusOr<std::vector<dataset::ScanFile>> scans = dataset::ListBagScans(options, notes);
  if (scans.ok()) WriteNotes(notes);
  return scans;
}

void PoseOptions::DeclareFiles(CLI::App& app, const std::string& poses_flag,
                               const std::string& calib_flag) {
  auto* poses = app.add_option(poses_flag, drive_.poses_file, "Their poses")->type_name("FILE");
  app.add_option(calib_flag, drive_.calib_file, "Their calibration, as --calib")
      ->type_name("FILE")
      ->needs(poses);
}

absl::StatusOr<dataset::Drive> PoseOptions::OpenDrive(const std::string& scans_dir) const {
  if (has_bag()) {
    dataset::BagDriveOptions bag = bag_;
    bag.calib_file = drive_.calib_file;
    bag.T_body_sensor = T_body_sensor();
    absl::StatusOr<dataset::Drive> drive = dataset::OpenBagDrive(bag);
    if (drive.ok()) WriteNotes(drive->notes);
    return drive;
  }
  dataset::DriveOptions options = drive_;
  options.scans_dir = scans_dir;
  options.T_body_sensor = T_body_sensor();
  ASSIGN_OR_RETURN(options.format, dataset::ParsePoseFormat(format_));
  absl::StatusOr<dataset::Drive> drive = dataset::OpenDrive(options);
  if (drive.ok()) WriteNotes(drive->notes);
  return drive;
}

absl::StatusOr<dataset::Trajectory> PoseOptions::ReadTrajectory() const {
  ASSIGN_OR_RETURN(const dataset::PoseFormat format, dataset::ParsePoseFormat(format_));
  absl::StatusOr<dataset::Trajectory> trajectory =
      dataset::ReadTrajectory(drive_.poses_file, format, drive_.calib_file);
  if (trajectory.ok()) WriteNotes(trajectory->notes);
  return trajectory;
}

std::string DefaultSessionName(const std::string& scans_dir) {
  // A folder of scans, and the one that it stands in.
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kScanFolders = {
      {{"velodyne", ""},
       {"velodyne_sync", ""},
       {"Scans", ""},
       {"Ouster", "sensor_data"},
       {"lidars", "train"}}};
  std::error_code error;
  std::filesystem::path folder = std::filesystem::weakly_canonical(scans_dir, error);
  if (error) folder = scans_dir;
  if (!folder.has_filename()) folder = folder.parent_path();
  for (const auto& [inner, outer] : kScanFolders) {
    if (folder.filename() != inner) continue;
    folder = folder.parent_path();
    if (!outer.empty() && folder.filename() == outer) folder = folder.parent_path();
    break;
  }
  return folder.filename().empty() ? "session" : folder.filename().string();
}

}  // namespace scanloc::cli
