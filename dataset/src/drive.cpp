#include "scanloc/dataset/drive.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "file_bytes.hpp"
#include "name_order.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "scanloc/core/status_macros.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kNsPerMs = 1'000'000;

double Seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

// KITTI's calib.txt, beside the folder of the scans.
std::string FindKittiCalib(const std::vector<ScanFile>& scans) {
  std::error_code error;
  const fs::path folder = fs::absolute(scans.front().path, error).parent_path();
  for (const fs::path& calib : {folder / "calib.txt", folder.parent_path() / "calib.txt"}) {
    std::error_code none;
    if (fs::is_regular_file(calib, none)) return calib.string();
  }
  return "";
}

absl::StatusOr<Trajectory> ReadPoses(const DriveOptions& options,
                                     const std::vector<ScanFile>& scans) {
  absl::StatusOr<Trajectory> trajectory =
      ReadTrajectory(options.poses_file, options.format, options.calib_file, options.T_body_sensor);
  if (!trajectory.ok() || !options.calib_file.empty() || options.T_body_sensor) return trajectory;
  if (trajectory->format == PoseFormat::kMatrix && options.format == PoseFormat::kAuto &&
      absl::EndsWithIgnoreCase(scans.front().name, ".npy")) {
    return Invalid(
        absl::StrCat(options.poses_file,
                     ": 4x4 matrices beside .npy scans are NAVER LABS's, poses of the "
                     "vehicle, but there is no calibration.json in the folders above; give "
                     "it as --calib"));
  }
  if (!MovesLikeACamera(*trajectory)) return trajectory;
  const std::string calib =
      trajectory->format == PoseFormat::kKitti ? FindKittiCalib(scans) : std::string();
  if (calib.empty()) {
    trajectory->notes.push_back(absl::StrCat(
        "the poses of ", options.poses_file,
        " move along their z, as those of a camera: if they are a camera's, give the mount of the "
        "sensor as --calib (KITTI: the calib.txt of the sequence)"));
    return trajectory;
  }
  absl::StatusOr<Trajectory> of_sensor =
      ReadTrajectory(options.poses_file, PoseFormat::kKitti, calib);
  if (of_sensor.ok()) {
    of_sensor->notes.push_back(absl::StrCat(options.poses_file,
                                            ": the poses move along their z, as those of a "
                                            "camera: ",
                                            calib, " is used to make them poses of the sensor"));
  }
  return of_sensor;
}

// One stamp a scan, or none at all.
absl::StatusOr<std::vector<std::int64_t>> StampsOfScans(const std::vector<ScanFile>& scans,
                                                        const DriveOptions& options,
                                                        PoseFormat format, const NameOrder& order) {
  std::string times_file = options.times_file;
  if (times_file.empty() && (format == PoseFormat::kNaver || format == PoseFormat::kMatrix)) {
    const fs::path beside = fs::path(options.poses_file).replace_filename("timestamps.txt");
    std::error_code none;
    if (fs::is_regular_file(beside, none)) times_file = beside.string();
  }
  if (!times_file.empty()) {
    absl::StatusOr<std::vector<std::int64_t>> stamps_ns = ReadTimes(times_file);
    if (stamps_ns.ok() && stamps_ns->size() != scans.size()) {
      return Invalid(absl::StrCat(times_file, ": holds ", stamps_ns->size(), " times, but ",
                                  options.scans_dir, " holds ", scans.size(), " scans"));
    }
    return stamps_ns;
  }
  return order.stamps_ns;
}

// A frame for each scan that has a pose: pose_of(i) is the number of the i-th scan's, or none.
template <typename PoseOf>
Drive Paired(const std::vector<ScanFile>& scans, const std::vector<std::int64_t>& stamps_ns,
             const Trajectory& trajectory, const PoseOf& pose_of) {
  Drive drive;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const std::optional<std::size_t> pose = pose_of(i);
    if (!pose) {
      ++drive.num_without_pose;
      continue;
    }
    drive.frames.push_back({.path = scans[i].path,
                            .name = scans[i].name,
                            .T_map_sensor = trajectory.T_map_sensor[*pose],
                            .stamp_ns = stamps_ns.empty() ? 0 : stamps_ns[i],
                            .layout = scans[i].layout,
                            .partner_path = scans[i].partner_path});
  }
  return drive;
}

// A row paired by its number has a time that follows the one before: else rows are missing, twice
// there, or of two drives.
absl::Status CheckTimesRise(const std::vector<std::int64_t>& stamps_ns, const std::string& file) {
  const auto fall = std::ranges::adjacent_find(stamps_ns, std::greater<>());
  if (fall == stamps_ns.end()) return absl::OkStatus();
  return Invalid(
      absl::StrCat(file, ": time ", fall - stamps_ns.begin() + 2, ", ", fall[1],
                   " ns, is earlier than the one before it, ", fall[0],
                   " ns, but scans are paired with poses in their order; sort the rows, or "
                   "give the scans their own times with --times"));
}

absl::StatusOr<Drive> PairByIndex(const DriveOptions& options, const std::vector<ScanFile>& scans,
                                  const std::vector<std::int64_t>& scan_stamps_ns,
                                  const Trajectory& trajectory) {
  if (scans.size() != trajectory.T_map_sensor.size()) {
    return Invalid(absl::StrCat(options.scans_dir, " holds ", scans.size(), " scans, but ",
                                options.poses_file, " holds ", trajectory.T_map_sensor.size(),
                                " poses; each scan needs the one in the row of its place in name "
                                "order"));
  }
  for (const absl::Status& status :
       {CheckTimesRise(trajectory.stamps_ns, options.poses_file),
        CheckTimesRise(scan_stamps_ns,
                       options.times_file.empty() ? options.scans_dir : options.times_file)}) {
    if (!status.ok()) return status;
  }
  const std::vector<std::int64_t>& stamps_ns =
      scan_stamps_ns.empty() ? trajectory.stamps_ns : scan_stamps_ns;
  return Paired(scans, stamps_ns, trajectory, [](std::size_t i) { return std::optional(i); });
}

// Finds the pose nearest in time; stamps need not be in order in the file.
class PosesByStamp {
 public:
  explicit PosesByStamp(const Trajectory& trajectory) {
    for (std::size_t i = 0; i < trajectory.stamps_ns.size(); ++i) {
      order_.emplace_back(trajectory.stamps_ns[i], i);
    }
    std::ranges::sort(order_);
  }

  // Of two poses at one time neither is known to be right.
  [[nodiscard]] absl::Status CheckAgree(const Trajectory& trajectory) const {
    for (std::size_t i = 1, first = 0; i < order_.size(); ++i) {
      if (order_[i].first != order_[first].first) first = i;
      const auto [stamp_ns, a] = order_[first];
      const std::size_t b = order_[i].second;
      const PoseDifference difference =
          DifferenceOf(trajectory.T_map_sensor[a], trajectory.T_map_sensor[b]);
      if (!MissOf(difference).any()) continue;
      return Invalid(absl::StrFormat(
          "poses %d and %d have the same stamp, %.9f s, but lie %.2f m and %.1f deg apart; write "
          "stamps with all their digits, and leave out the one that is wrong",
          a + 1, b + 1, Seconds(stamp_ns), std::hypot(difference.plane_m, difference.height_m),
          difference.heading_deg));
    }
    return absl::OkStatus();
  }

  // None if the nearest lies beyond kMaxStampGap_ns.
  [[nodiscard]] std::optional<std::size_t> Nearest(std::int64_t stamp_ns) const {
    const auto after =
        std::lower_bound(order_.begin(), order_.end(), std::pair(stamp_ns, std::size_t{0}));
    std::optional<std::size_t> nearest;
    std::uint64_t least_gap_ns = kMaxStampGap_ns;
    const auto consider = [&](const std::pair<std::int64_t, std::size_t>& candidate) {
      const std::uint64_t gap_ns = Gap(stamp_ns, candidate.first);
      if (gap_ns > least_gap_ns || (nearest.has_value() && gap_ns == least_gap_ns)) return;
      nearest = candidate.second;
      least_gap_ns = gap_ns;
    };
    if (after != order_.begin()) consider(*(after - 1));
    if (after != order_.end()) consider(*after);
    return nearest;
  }

 private:
  // Unsigned: the difference of two stamps need not fit a signed one.
  static std::uint64_t Gap(std::int64_t a, std::int64_t b) {
    const auto low = static_cast<std::uint64_t>(std::min(a, b));
    return static_cast<std::uint64_t>(std::max(a, b)) - low;
  }

  std::vector<std::pair<std::int64_t, std::size_t>> order_;  // stamp [ns], index of the pose
};

// Two clocks make drives that meet by chance, at their ends.
absl::Status CheckOneClock(const DriveOptions& options,
                           const std::vector<std::int64_t>& scan_stamps_ns,
                           const std::vector<std::int64_t>& pose_stamps_ns) {
  const auto [first_scan, last_scan] = std::ranges::minmax(scan_stamps_ns);
  const auto [first_pose, last_pose] = std::ranges::minmax(pose_stamps_ns);
  // As doubles: the difference of two stamps need not fit.
  const double scans_s = Seconds(last_scan) - Seconds(first_scan);
  const double poses_s = Seconds(last_pose) - Seconds(first_pose);
  const double both_s =
      Seconds(std::min(last_scan, last_pose)) - Seconds(std::max(first_scan, first_pose));
  if (2.0 * (both_s + Seconds(kMaxStampGap_ns)) >= std::min(scans_s, poses_s))
    return absl::OkStatus();
  return Invalid(absl::StrFormat(
      "the scans of %s, of %.3f to %.3f s, and the poses of %s, of %.3f to %.3f s, have %.1f s in "
      "common: are their stamps by one clock? GPS time is 18 s ahead of UTC. If they are, leave "
      "out the poses before the first scan and after the last",
      options.scans_dir, Seconds(first_scan), Seconds(last_scan), options.poses_file,
      Seconds(first_pose), Seconds(last_pose), both_s));
}

absl::StatusOr<Drive> PairByStamp(const DriveOptions& options, const std::vector<ScanFile>& scans,
                                  const std::vector<std::int64_t>& scan_stamps_ns,
                                  const Trajectory& trajectory) {
  const PosesByStamp poses(trajectory);
  if (absl::Status status = poses.CheckAgree(trajectory); !status.ok()) {
    return Annotate(status, options.poses_file);
  }
  Drive drive = Paired(scans, scan_stamps_ns, trajectory,
                       [&](std::size_t i) { return poses.Nearest(scan_stamps_ns[i]); });
  if (drive.frames.empty()) {
    return Invalid(absl::StrFormat(
        "none of the %d scans of %s lies within %d ms of a pose of %s; the first scan's stamp is "
        "%.3f s, the first pose's %.3f s",
        scans.size(), options.scans_dir, kMaxStampGap_ns / kNsPerMs, options.poses_file,
        Seconds(scan_stamps_ns.front()), Seconds(trajectory.stamps_ns.front())));
  }
  RETURN_IF_ERROR(CheckOneClock(options, scan_stamps_ns, trajectory.stamps_ns));
  return drive;
}

// The numbers in the names of the scans are those of the poses.
absl::StatusOr<Drive> PairByNumber(const DriveOptions& options, const std::vector<ScanFile>& scans,
                                   const std::vector<std::int64_t>& scan_stamps_ns,
                                   const std::vector<std::int64_t>& numbers,
                                   const Trajectory& trajectory) {
  std::map<std::int64_t, std::size_t> poses;
  for (std::size_t i = 0; i < trajectory.frame_numbers.size(); ++i) {
    if (!poses.emplace(trajectory.frame_numbers[i], i).second) {
      return Invalid(absl::StrCat(options.poses_file, ": frame ", trajectory.frame_numbers[i],
                                  " is there twice"));
    }
  }
  Drive drive = Paired(scans, scan_stamps_ns, trajectory, [&](std::size_t i) {
    const auto pose = poses.find(numbers[i]);
    return pose == poses.end() ? std::nullopt : std::optional(pose->second);
  });
  if (drive.frames.empty()) {
    return Invalid(absl::StrCat("none of the numbers of the scans of ", options.scans_dir,
                                " is that of a frame of ", options.poses_file, "; the first are ",
                                numbers.front(), " and ", trajectory.frame_numbers.front()));
  }
  return drive;
}

absl::StatusOr<Drive> Pair(const DriveOptions& options, const std::vector<ScanFile>& scans,
                           const std::vector<std::int64_t>& scan_stamps_ns,
                           const std::vector<std::int64_t>& numbers, const Trajectory& trajectory) {
  if (!trajectory.stamps_ns.empty() && !scan_stamps_ns.empty()) {
    return PairByStamp(options, scans, scan_stamps_ns, trajectory);
  }
  if (!trajectory.frame_numbers.empty() && !numbers.empty()) {
    return PairByNumber(options, scans, scan_stamps_ns, numbers, trajectory);
  }
  return PairByIndex(options, scans, scan_stamps_ns, trajectory);
}

}  // namespace

absl::StatusOr<Drive> OpenDrive(const DriveOptions& options) {
  if (options.scans_dir.empty()) return Invalid("no folder of scans is given");
  if (options.poses_file.empty()) return Invalid("no file of poses is given");
  ASSIGN_OR_RETURN(const std::vector<ScanFile> scans, ListScans(options.scans_dir));
  ASSIGN_OR_RETURN(const Trajectory trajectory, ReadPoses(options, scans));
  std::vector<std::string> notes = trajectory.notes;
  std::vector<std::string_view> names;
  for (const ScanFile& scan : scans) names.push_back(scan.name);
  const NameOrder order = OrderNames(names);
  ASSIGN_OR_RETURN(const std::vector<std::int64_t> scan_stamps_ns,
                   StampsOfScans(scans, options, trajectory.format, order));
  if (!order.doubt.empty() && order.stamps_ns.empty()) {
    return Invalid(
        absl::StrCat(options.scans_dir, ": the order of the scans is not plain: ", order.doubt));
  }
  if (!order.note.empty() && scan_stamps_ns == order.stamps_ns) notes.push_back(order.note);
  if (!std::ranges::is_sorted(scan_stamps_ns)) {
    notes.push_back(absl::StrCat("the times in ", options.times_file,
                                 " do not rise: is its order that of the names of the scans?"));
  }
  absl::StatusOr<Drive> drive = Pair(options, scans, scan_stamps_ns, order.numbers, trajectory);
  if (!drive.ok()) return drive;
  if (drive->num_without_pose > 0) {
    notes.push_back(absl::StrCat(
        drive->num_without_pose, " of the ", scans.size(), " scans of ", options.scans_dir,
        " are left out: ",
        trajectory.frame_numbers.empty()
            ? absl::StrCat("no pose lies within ", kMaxStampGap_ns / kNsPerMs, " ms of them")
            : "no pose has their number"));
  }
  drive->notes = std::move(notes);
  return drive;
}

}  // namespace scanloc::dataset
