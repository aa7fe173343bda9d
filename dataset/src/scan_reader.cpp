#include "scanloc/dataset/scan_reader.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <new>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "file_bytes.hpp"
#include "scan_decoders.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

struct Format {
  std::string_view extension;
  absl::StatusOr<Scan> (*decode)(std::string_view bytes, bool with_intensities);
  std::string_view begin = {};  // of every such file; empty: anything
};
constexpr std::array<Format, 5> kFormats = {{{".npy", DecodeNpy, "\x93NUMPY"},
                                             {".pcd", DecodePcd, "# .PCD"},
                                             {".pcd", DecodePcd, "VERSION"},
                                             {".ply", DecodePly, "ply"},
                                             {".bin", DecodeKittiBin}}};

const Format* FindFormat(std::string_view path) {
  const auto* const format = std::ranges::find_if(kFormats, [path](const Format& candidate) {
    return absl::EndsWithIgnoreCase(ToAbsl(path), ToAbsl(candidate.extension));
  });
  return format == kFormats.end() ? nullptr : format;
}

// .bin if it begins as none of the others.
const Format* FormatOfBeginning(std::string_view bytes) {
  return std::ranges::find_if(kFormats, [&](const Format& candidate) {
    return absl::StartsWith(ToAbsl(bytes), ToAbsl(candidate.begin));
  });
}

std::size_t CountBeyondLimit(const PointCloud& points) {
  // Number by number becomes vectors, and most often there is none.
  const auto* const numbers = reinterpret_cast<const float*>(points.data());
  std::uint32_t num_beyond = 0;
  for (std::size_t i = 0; i < 3 * points.size(); ++i) {
    num_beyond += std::abs(numbers[i]) > limits::kMaxCoordinate_m ? 1 : 0;
  }
  if (num_beyond == 0) return 0;
  return static_cast<std::size_t>(std::ranges::count_if(points, &IsBeyondLimit));
}

// Points in another unit or frame would all be skipped later, and the scan pass as an empty one.
absl::Status CheckMetres(const Scan& scan) {
  constexpr std::size_t kFew = 100;  // fewer may stand anywhere
  constexpr float kNear_m = 1.0F;
  constexpr float kFar_m = 80.0F;
  const PointCloud& points = scan.points;
  const std::size_t num_points = points.size();
  const std::size_t num_within = num_points - CountBeyondLimit(points);
  if (2 * num_within < num_points) {
    return absl::InvalidArgumentError(
        absl::StrCat(num_points - num_within, " of its ", num_points, " points lie beyond ",
                     limits::kMaxCoordinate_m,
                     " m of the origin; a scan must be in the sensor frame, in metres"));
  }
  const auto squared_m2 = [](const Point& p) { return p.x * p.x + p.y * p.y + p.z * p.z; };
  const bool is_all_far =
      std::ranges::all_of(points, [&](const Point& p) { return squared_m2(p) > kFar_m * kFar_m; });
  const bool is_all_near = std::ranges::all_of(
      points, [&](const Point& p) { return squared_m2(p) < kNear_m * kNear_m; });
  if (num_points < kFew || !(is_all_far || is_all_near)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("0 of its ", num_points, " points lie ",
                   is_all_far ? absl::StrCat("within ", kFar_m) : absl::StrCat("beyond ", kNear_m),
                   " m of the sensor: are these metres, in the sensor frame?"));
}

}  // namespace

bool IsScanFile(std::string_view path) { return FindFormat(path) != nullptr; }

namespace {

using Decode = std::function<absl::StatusOr<Scan>(std::string_view bytes)>;

absl::StatusOr<Scan> Checked(absl::StatusOr<Scan> scan, const std::string& name) {
  if (!scan.ok()) return Annotate(scan.status(), name);
  if (absl::Status status = CheckMetres(*scan); !status.ok()) return Annotate(status, name);
  return scan;
}

absl::Status OutOfMemory(const std::string& name) {
  return absl::ResourceExhaustedError(absl::StrCat(name, ": out of memory"));
}

absl::StatusOr<Scan> ReadAs(const std::string& path, const Decode& decode) try {
  ASSIGN_OR_RETURN(const FileBytes bytes, ReadFileBytes(path, limits::kMaxScanFileBytes));
  return Checked(decode(bytes.view()), path);
} catch (const std::bad_alloc&) {
  return OutOfMemory(path);
}

// What cannot be read may have the name of another format.
absl::StatusOr<Scan> DecodeNamed(const Format& format, std::string_view bytes,
                                 bool with_intensities) {
  absl::StatusOr<Scan> scan = format.decode(bytes, with_intensities);
  const Format& begun = *FormatOfBeginning(bytes);
  if (scan.ok() || begun.begin.empty() || begun.extension == format.extension) return scan;
  return absl::InvalidArgumentError(absl::StrCat("begins as a ", ToAbsl(begun.extension),
                                                 " file does, but is named ",
                                                 ToAbsl(format.extension), "; give it its name"));
}

absl::StatusOr<Scan> ReadPath(const std::string& path, bool with_intensities) {
  return ReadAs(path, [&](std::string_view bytes) -> absl::StatusOr<Scan> {
    const Format* format = FindFormat(path);
    if (format != nullptr) return DecodeNamed(*format, bytes, with_intensities);
    return absl::InvalidArgumentError(
        "is no scan file; scans are .bin (KITTI), .npy (NAVER LABS), .pcd or .ply");
  });
}

absl::StatusOr<std::string> ReadToEnd(std::FILE* stream, const std::string& name) {
  std::string bytes;
  std::array<char, 65536> block{};
  while (const std::size_t n = std::fread(block.data(), 1, block.size(), stream)) {
    bytes.append(block.data(), n);
    if (bytes.size() > static_cast<std::size_t>(limits::kMaxScanFileBytes)) {
      return absl::InvalidArgumentError(absl::StrCat(name, ": holds more than ",
                                                     limits::kMaxScanFileBytes,
                                                     " bytes, which is all that is read"));
    }
  }
  if (std::ferror(stream) != 0)
    return absl::UnavailableError(absl::StrCat(name, ": cannot be read"));
  if (bytes.empty()) return absl::InvalidArgumentError(absl::StrCat(name, ": is empty"));
  return bytes;
}

absl::StatusOr<Scan> DecodeByBeginning(std::string_view bytes, const std::string& name) {
  return Checked(FormatOfBeginning(bytes)->decode(bytes, false), name);
}

}  // namespace

absl::StatusOr<Scan> ReadScan(const std::string& path) { return ReadPath(path, false); }

absl::StatusOr<Scan> ReadScan(std::FILE* stream, const std::string& name) try {
  ASSIGN_OR_RETURN(const std::string bytes, ReadToEnd(stream, name));
  return DecodeByBeginning(bytes, name);
} catch (const std::bad_alloc&) {
  return OutOfMemory(name);
}

absl::StatusOr<Scan> ReadScanBytes(std::string_view bytes, const std::string& name) try {
  if (bytes.empty()) return absl::InvalidArgumentError(absl::StrCat(name, ": is empty"));
  const Format* const format = FindFormat(name);
  return format == nullptr ? DecodeByBeginning(bytes, name)
                           : Checked(format->decode(bytes, false), name);
} catch (const std::bad_alloc&) {
  return OutOfMemory(name);
}

namespace {

absl::StatusOr<Scan> ReadFile(const ScanFile& file, bool with_intensities) {
  if (file.store != nullptr) {
    absl::StatusOr<Scan> scan = file.store->Read(file.index, with_intensities);
    if (!scan.ok()) return scan;
    if (absl::Status status = CheckMetres(*scan); !status.ok()) return Annotate(status, file.name);
    return scan;
  }
  if (file.layout == ScanLayout::kNclt) {
    return ReadAs(file.path,
                  [&](std::string_view bytes) { return DecodeNcltSync(bytes, with_intensities); });
  }
  if (file.layout != ScanLayout::kOxford) return ReadPath(file.path, with_intensities);
  const auto read = [&](const std::string& path, bool is_left) {
    return ReadAs(path, [&](std::string_view bytes) {
      return DecodeOxford(bytes, is_left, with_intensities);
    });
  };
  ASSIGN_OR_RETURN(Scan left, read(file.path, true));
  ASSIGN_OR_RETURN(const Scan right, read(file.partner_path, false));
  left.points.insert(left.points.end(), right.points.begin(), right.points.end());
  left.intensities.insert(left.intensities.end(), right.intensities.begin(),
                          right.intensities.end());
  left.num_not_finite += right.num_not_finite;
  return left;
}

}  // namespace

absl::StatusOr<Scan> ReadScan(const ScanFile& file) { return ReadFile(file, false); }

absl::StatusOr<Scan> ReadScanWithIntensities(const ScanFile& file) {
  absl::StatusOr<Scan> scan = ReadFile(file, true);
  if (!scan.ok() || scan->intensities.size() == scan->points.size()) return scan;
  return absl::InvalidArgumentError(
      absl::StrCat(file.store == nullptr ? file.path : file.name,
                   ": its points have no intensities; read are the fourth value of .bin and a "
                   "field intensity, reflectivity or reflectance of .pcd, .ply and bags"));
}

}  // namespace scanloc::dataset
