#include "scanloc/dataset/scan_reader.hpp"

#include <algorithm>
#include <array>
#include <new>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "file_bytes.hpp"
#include "scan_decoders.hpp"
#include "scanloc/core/limits.hpp"

namespace scanloc::dataset {
namespace {

struct Format {
  std::string_view extension;
  absl::StatusOr<Scan> (*decode)(std::string_view bytes);
};
constexpr std::array<Format, 3> kFormats = {
    {{".bin", DecodeKittiBin}, {".pcd", DecodePcd}, {".ply", DecodePly}}};

const Format* FindFormat(std::string_view path) {
  const auto* const format =
      std::find_if(kFormats.begin(), kFormats.end(), [path](const Format& candidate) {
        return absl::EndsWithIgnoreCase(ToAbsl(path), ToAbsl(candidate.extension));
      });
  return format == kFormats.end() ? nullptr : format;
}

// Points far from the origin would all be skipped later, and the scan pass as an empty one.
absl::Status CheckNearSensor(const Scan& scan) {
  const auto num_beyond = static_cast<std::size_t>(
      std::count_if(scan.points.begin(), scan.points.end(), IsBeyondLimit));
  if (num_beyond <= scan.points.size() / 2) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      num_beyond, " of its ", scan.points.size(), " points lie beyond ", limits::kMaxCoordinate_m,
      " m of the origin; a scan must be in the sensor frame, in metres"));
}

}  // namespace

bool IsScanFile(std::string_view path) { return FindFormat(path) != nullptr; }

absl::StatusOr<Scan> ReadScan(const std::string& path) try {
  const absl::StatusOr<FileBytes> bytes = ReadFileBytes(path, limits::kMaxScanFileBytes);
  if (!bytes.ok()) return bytes.status();
  const Format* format = FindFormat(path);
  if (format == nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": is no scan file; scans are .bin (KITTI), .pcd or .ply"));
  }
  absl::StatusOr<Scan> scan = format->decode(bytes->view());
  if (!scan.ok()) return Annotate(scan.status(), path);
  if (absl::Status status = CheckNearSensor(*scan); !status.ok()) return Annotate(status, path);
  return scan;
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError(absl::StrCat(path, ": out of memory"));
}

}  // namespace scanloc::dataset
