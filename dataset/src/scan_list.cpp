#include "scan_list.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "name_order.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/dataset/drive.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

namespace fs = std::filesystem;

// Where a sequence keeps its scans: KITTI, PCD exports, MulRan, NAVER LABS.
constexpr std::array<std::string_view, 6> kInnerFolders = {
    "velodyne", "Scans", "Ouster", "sensor_data/Ouster", "lidars", "train/lidars"};

absl::StatusOr<std::vector<ScanFile>> ListFolder(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) {
    return absl::NotFoundError(absl::StrCat(folder.string(), ": no such folder"));
  }
  if (!fs::is_directory(folder, error)) {
    return Invalid(absl::StrCat(folder.string(), ": is not a folder"));
  }
  std::vector<ScanFile> scans;
  fs::directory_iterator entry(folder, error);
  for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
    ScanFile scan{entry->path().string(), entry->path().filename().string()};
    std::error_code unreadable;
    if (scan.name.front() != '.' && IsScanFile(scan.name) && entry->is_regular_file(unreadable)) {
      scans.push_back(std::move(scan));
    }
  }
  if (error) {
    return absl::ErrnoToStatus(error.value(), absl::StrCat(folder.string(), ": cannot be listed"));
  }
  std::vector<std::string_view> names;
  for (const ScanFile& scan : scans) names.push_back(scan.name);
  std::vector<ScanFile> ordered;
  for (const std::size_t i : OrderNames(names).order) ordered.push_back(scans[i]);
  return ordered;
}

/// Left and right scans of Oxford Radar RobotCar, each with its partner.
absl::StatusOr<std::vector<ScanFile>> ListOxford(const fs::path& left, const fs::path& right) {
  absl::StatusOr<std::vector<ScanFile>> scans = ListFolder(left);
  if (!scans.ok()) return scans;
  ASSIGN_OR_RETURN(const std::vector<ScanFile> partners, ListFolder(right));
  std::map<std::int64_t, const ScanFile*> by_stamp;
  for (const ScanFile& partner : partners) {
    if (const auto stamp_ns = StampOfName(partner.name)) by_stamp[*stamp_ns] = &partner;
  }
  std::vector<ScanFile> pairs;
  for (ScanFile& scan : *scans) {
    const auto stamp_ns = StampOfName(scan.name);
    if (!stamp_ns || by_stamp.empty()) continue;
    auto nearest = by_stamp.lower_bound(*stamp_ns);
    if (nearest == by_stamp.end() ||
        (nearest != by_stamp.begin() &&
         *stamp_ns - std::prev(nearest)->first < nearest->first - *stamp_ns)) {
      --nearest;
    }
    if (std::abs(nearest->first - *stamp_ns) > kMaxPartnerGap_ns) continue;
    scan.layout = ScanLayout::kOxford;
    scan.partner_path = nearest->second->path;
    pairs.push_back(std::move(scan));
  }
  if (!pairs.empty()) return pairs;
  return Invalid(absl::StrCat("no scan of ", left.string(), " has one of ", right.string(),
                              " within ", kMaxPartnerGap_ns,
                              " ns; their names give the time in microseconds"));
}

absl::StatusOr<std::vector<ScanFile>> ListNclt(const fs::path& folder) {
  absl::StatusOr<std::vector<ScanFile>> scans = ListFolder(folder);
  if (!scans.ok()) return scans;
  for (ScanFile& scan : *scans) {
    if (fs::path(scan.name).extension() == ".bin") scan.layout = ScanLayout::kNclt;
  }
  return scans;
}

}  // namespace

std::string_view Stem(std::string_view name) { return name.substr(0, name.rfind('.')); }

bool IsNumber(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

std::optional<std::int64_t> StampOfName(std::string_view name) {
  const std::string_view stem = Stem(name);
  std::int64_t value = 0;
  if (!IsNumber(stem) || !absl::SimpleAtoi(ToAbsl(stem), &value)) return std::nullopt;
  if (stem.size() == 19) return value;
  if (stem.size() == 16) {
    constexpr std::int64_t kMax_us = std::numeric_limits<std::int64_t>::max() / 1000;
    return value <= kMax_us ? std::optional(value * 1000) : std::nullopt;
  }
  return std::nullopt;
}

absl::StatusOr<std::vector<ScanFile>> ListScans(const std::string& scans_dir) {
  const fs::path given(scans_dir);
  const std::string name = (given.has_filename() ? given : given.parent_path()).filename().string();
  absl::StatusOr<std::vector<ScanFile>> scans =
      name == "velodyne_sync" ? ListNclt(given) : ListFolder(given);
  if (!scans.ok() || !scans->empty()) return scans;
  std::error_code none;
  if (const fs::path sync = given / "velodyne_sync"; fs::is_directory(sync, none)) {
    scans = ListNclt(sync);
    if (!scans.ok() || !scans->empty()) return scans;
  }
  const fs::path left = given / "velodyne_left";
  const fs::path right = given / "velodyne_right";
  if (fs::is_directory(left, none) && fs::is_directory(right, none)) return ListOxford(left, right);
  for (const std::string_view inner : kInnerFolders) {
    const fs::path folder = given / inner;
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored)) continue;
    scans = ListFolder(folder);
    if (!scans.ok() || !scans->empty()) return scans;
  }
  return Invalid(absl::StrCat(scans_dir, ": holds no scan (.bin, .npy, .pcd or .ply)"));
}

}  // namespace scanloc::dataset
