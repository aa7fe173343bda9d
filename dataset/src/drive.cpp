#include "scanloc/dataset/drive.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "scan_list.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kNsPerMs = 1'000'000;

absl::Status Bad(std::string_view reason) { return absl::InvalidArgumentError(ToAbsl(reason)); }

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

// The poses; what the user should know of them is added to notes.
absl::StatusOr<Trajectory> ReadPoses(const DriveOptions& options,
                                     const std::vector<ScanFile>& scans,
                                     std::vector<std::string>& notes) {
  absl::StatusOr<Trajectory> trajectory =
      ReadTrajectory(options.poses_file, options.format, options.calib_file);
  if (!trajectory.ok()) return trajectory;
  if (trajectory->num_left_out > 0) {
    notes.push_back(absl::StrCat(trajectory->num_left_out, " rows of ", options.poses_file,
                                 " are left out: they hold no good pose"));
  }
  if (trajectory->format != PoseFormat::kKitti || !options.calib_file.empty() ||
      !MovesLikeACamera(*trajectory)) {
    return trajectory;
  }
  const std::string calib = FindKittiCalib(scans);
  if (calib.empty()) {
    notes.push_back(absl::StrCat("the poses of ", options.poses_file,
                                 " move along their z, as those of a camera: if they are KITTI's, "
                                 "give the calib.txt of the sequence as --calib"));
    return trajectory;
  }
  notes.push_back(absl::StrCat("the poses of ", options.poses_file,
                               " move along their z, as those of a camera: ", calib,
                               " is used to make them poses of the sensor"));
  return ReadTrajectory(options.poses_file, PoseFormat::kKitti, calib);
}

// One stamp a scan, or none at all.
absl::StatusOr<std::vector<std::int64_t>> StampsOfScans(const std::vector<ScanFile>& scans,
                                                        const DriveOptions& options,
                                                        PoseFormat format) {
  std::string times_file = options.times_file;
  if (times_file.empty() && format == PoseFormat::kNaver) {
    const fs::path beside = fs::path(options.poses_file).replace_filename("timestamps.txt");
    std::error_code none;
    if (fs::is_regular_file(beside, none)) times_file = beside.string();
  }
  if (!times_file.empty()) {
    absl::StatusOr<std::vector<std::int64_t>> stamps_ns = ReadTimes(times_file);
    if (stamps_ns.ok() && stamps_ns->size() != scans.size()) {
      return Bad(absl::StrCat(times_file, ": holds ", stamps_ns->size(), " times, but ",
                              options.scans_dir, " holds ", scans.size(), " scans"));
    }
    return stamps_ns;
  }
  std::vector<std::int64_t> stamps_ns;
  for (const ScanFile& scan : scans) {
    const std::optional<std::int64_t> stamp_ns = StampOfName(scan.name);
    if (!stamp_ns) return std::vector<std::int64_t>();
    stamps_ns.push_back(*stamp_ns);
  }
  return stamps_ns;
}

// Leading zeros aside, a longer number is the greater one.
bool IsLowerNumber(std::string_view a, std::string_view b) {
  const auto strip = [](std::string_view digits) {
    return digits.substr(std::min(digits.find_first_not_of('0'), digits.size()));
  };
  const std::string_view x = strip(a);
  const std::string_view y = strip(b);
  return x.size() != y.size() ? x.size() < y.size() : x < y;
}

// 10.bin sorts before 2.bin: pairing such scans by their order would give them wrong poses.
absl::Status CheckNumbersSorted(const std::vector<ScanFile>& scans) {
  for (std::size_t i = 1; i < scans.size(); ++i) {
    const std::string_view last = Stem(scans[i - 1].name);
    const std::string_view next = Stem(scans[i].name);
    if (IsNumber(last) && IsNumber(next) && IsLowerNumber(next, last)) {
      return Bad(absl::StrCat("scans are paired with poses in name order, but ", scans[i - 1].name,
                              " sorts before ", scans[i].name,
                              "; give their numbers leading zeros"));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<Drive> PairByIndex(const DriveOptions& options, const std::vector<ScanFile>& scans,
                                  const std::vector<std::int64_t>& scan_stamps_ns,
                                  const Trajectory& trajectory) {
  if (scans.size() != trajectory.T_map_sensor.size()) {
    return Bad(absl::StrCat(options.scans_dir, " holds ", scans.size(), " scans, but ",
                            options.poses_file, " holds ", trajectory.T_map_sensor.size(),
                            " poses; each scan needs the one in the row of its place in name "
                            "order"));
  }
  if (absl::Status status = CheckNumbersSorted(scans); !status.ok()) return status;
  const std::vector<std::int64_t>& stamps_ns =
      scan_stamps_ns.empty() ? trajectory.stamps_ns : scan_stamps_ns;
  Drive drive;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    drive.frames.push_back({.path = scans[i].path,
                            .name = scans[i].name,
                            .T_map_sensor = trajectory.T_map_sensor[i],
                            .stamp_ns = stamps_ns.empty() ? 0 : stamps_ns[i],
                            .layout = scans[i].layout,
                            .partner_path = scans[i].partner_path});
  }
  return drive;
}

// Finds the pose nearest in time; stamps need not be in order in the file.
class PosesByStamp {
 public:
  explicit PosesByStamp(const Trajectory& trajectory) {
    for (std::size_t i = 0; i < trajectory.stamps_ns.size(); ++i) {
      order_.emplace_back(trajectory.stamps_ns[i], i);
    }
    std::sort(order_.begin(), order_.end());
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

absl::StatusOr<Drive> PairByStamp(const DriveOptions& options, const std::vector<ScanFile>& scans,
                                  const std::vector<std::int64_t>& scan_stamps_ns,
                                  const Trajectory& trajectory) {
  const PosesByStamp poses(trajectory);
  Drive drive;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const std::optional<std::size_t> pose = poses.Nearest(scan_stamps_ns[i]);
    if (!pose) {
      ++drive.num_without_pose;
      continue;
    }
    drive.frames.push_back({.path = scans[i].path,
                            .name = scans[i].name,
                            .T_map_sensor = trajectory.T_map_sensor[*pose],
                            .stamp_ns = scan_stamps_ns[i],
                            .layout = scans[i].layout,
                            .partner_path = scans[i].partner_path});
  }
  if (drive.frames.empty()) {
    return Bad(absl::StrCat(
        "none of the ", scans.size(), " scans of ", options.scans_dir, " lies within ",
        kMaxStampGap_ns, " ns of a pose of ", options.poses_file, "; the first scan's stamp is ",
        scan_stamps_ns.front(), " ns, the first pose's ", trajectory.stamps_ns.front(), " ns"));
  }
  return drive;
}

}  // namespace

absl::StatusOr<Drive> OpenDrive(const DriveOptions& options) {
  if (options.scans_dir.empty()) return Bad("no folder of scans is given");
  if (options.poses_file.empty()) return Bad("no file of poses is given");
  const absl::StatusOr<std::vector<ScanFile>> scans = ListScans(options.scans_dir);
  if (!scans.ok()) return scans.status();
  std::vector<std::string> notes;
  const absl::StatusOr<Trajectory> trajectory = ReadPoses(options, *scans, notes);
  if (!trajectory.ok()) return trajectory.status();
  const absl::StatusOr<std::vector<std::int64_t>> scan_stamps_ns =
      StampsOfScans(*scans, options, trajectory->format);
  if (!scan_stamps_ns.ok()) return scan_stamps_ns.status();
  const bool both_have_stamps = !trajectory->stamps_ns.empty() && !scan_stamps_ns->empty();
  absl::StatusOr<Drive> drive = both_have_stamps
                                    ? PairByStamp(options, *scans, *scan_stamps_ns, *trajectory)
                                    : PairByIndex(options, *scans, *scan_stamps_ns, *trajectory);
  if (!drive.ok()) return drive;
  if (drive->num_without_pose > 0) {
    notes.push_back(absl::StrCat(drive->num_without_pose, " of the ", scans->size(), " scans of ",
                                 options.scans_dir, " are left out: no pose lies within ",
                                 kMaxStampGap_ns / kNsPerMs, " ms of them"));
  }
  drive->notes = std::move(notes);
  return drive;
}

std::vector<std::size_t> SelectBySpacing(std::span<const Frame> frames, double spacing_m) {
  constexpr double kSlack_m = 1e-3;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!kept.empty()) {
      const Eigen::Vector3d moved_m =
          frames[i].T_map_sensor.translation() - frames[kept.back()].T_map_sensor.translation();
      if (moved_m.norm() < spacing_m - kSlack_m) continue;
    }
    kept.push_back(i);
  }
  return kept;
}

}  // namespace scanloc::dataset
