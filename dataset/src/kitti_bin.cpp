#include <cmath>

#include "absl/strings/str_cat.h"
#include "scan_decoders.hpp"
#include "scanloc/core/byte_order.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::size_t kRecordBytes = 16;
constexpr std::size_t kRecordWithRingBytes = 20;
constexpr std::string_view kOtherLayouts =
    "; scanloc reads float32 x y z intensity, and with a ring number after it (nuScenes). Another "
    "layout, such as NCLT's velodyne_sync (packed integers) or rows of three or six floats, must "
    "be "
    "converted first";

float FloatAt(std::string_view bytes, std::size_t at) {
  return LoadNumber<float>(bytes.data() + at);
}

// Rows of five floats, the last of which is the number of a ray.
bool EndsInRings(std::string_view bytes) {
  constexpr float kMaxRing = 255.0F;
  if (bytes.empty() || bytes.size() % kRecordWithRingBytes != 0) return false;
  bool differ = false;
  const float first = FloatAt(bytes, kRecordBytes);
  for (std::size_t at = kRecordBytes; at < bytes.size(); at += kRecordWithRingBytes) {
    const float ring = FloatAt(bytes, at);
    if (!(ring >= 0.0F && ring <= kMaxRing) || ring != std::floor(ring)) return false;
    differ |= ring != first;
  }
  return differ;
}

// No LiDAR gives negative intensities, but for one value that says "unknown"; where rows have
// another length, coordinates stand in their place.
absl::Status CheckIntensities(std::string_view bytes) {
  if (bytes.empty()) return absl::OkStatus();
  std::size_t num_negative = 0;
  bool differ = false;
  const float first = FloatAt(bytes, 12);
  for (std::size_t at = 12; at < bytes.size(); at += kRecordBytes) {
    const float intensity = FloatAt(bytes, at);
    num_negative += intensity < 0.0F ? 1 : 0;
    differ |= intensity < 0.0F && intensity != first;
  }
  const std::size_t num_points = bytes.size() / kRecordBytes;
  if (!differ || num_negative * 20 <= num_points) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      num_negative, " of its ", num_points,
      " intensities are negative, as where rows of another length are read as rows of four floats",
      ToAbsl(kOtherLayouts)));
}

// A format without a header can only be told by its values: those of other layouts, taken as
// float32, are seldom NaN but mostly astronomically large or small.
struct Implausible {
  std::size_t num_not_finite = 0;
  std::size_t num_beyond_limit = 0;
  std::size_t num_tiny = 0;
  std::size_t num_zero = 0;  ///< at the origin
};

bool IsTiny(float value) {
  constexpr float kFinestCoordinate_m = 1e-6F;
  return value != 0.0F && std::abs(value) < kFinestCoordinate_m;
}

Implausible CountImplausible(const Scan& scan) {
  Implausible count{.num_not_finite = scan.num_not_finite};
  for (const Point& p : scan.points) {
    const bool beyond_limit = IsBeyondLimit(p);
    const bool tiny = IsTiny(p.x) || IsTiny(p.y) || IsTiny(p.z);
    count.num_beyond_limit += beyond_limit ? 1 : 0;
    count.num_tiny += tiny && !beyond_limit ? 1 : 0;
    count.num_zero += p == Point{} ? 1 : 0;
  }
  return count;
}

absl::Status CheckPlausible(const Scan& scan, std::size_t num_points) {
  const Implausible count = CountImplausible(scan);
  if (count.num_zero == num_points) {
    return absl::InvalidArgumentError(
        absl::StrCat("all of its ", num_points, " points are zero; the file was never filled"));
  }
  const std::size_t num_bad = count.num_not_finite + count.num_beyond_limit + count.num_tiny;
  if (num_bad <= num_points / 2) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(num_bad, " of its ", num_points, " points are no LiDAR returns in metres (",
                   count.num_not_finite, " not finite, ", count.num_beyond_limit, " beyond ",
                   limits::kMaxCoordinate_m, " m, ", count.num_tiny,
                   " with a coordinate below a micrometre)", ToAbsl(kOtherLayouts)));
}

}  // namespace

absl::StatusOr<Scan> DecodeKittiBin(std::string_view bytes, bool with_intensities) {
  const std::size_t record_bytes = EndsInRings(bytes) ? kRecordWithRingBytes : kRecordBytes;
  if (bytes.size() % record_bytes != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("its ", bytes.size(), " bytes are not a multiple of ", kRecordBytes,
                     ": truncated or not a KITTI scan", ToAbsl(kOtherLayouts)));
  }
  const std::size_t num_points = bytes.size() / record_bytes;
  if (num_points > limits::kMaxPointsPerScan) {
    return absl::InvalidArgumentError(absl::StrCat(
        "holds ", num_points, " points; a scan has at most ", limits::kMaxPointsPerScan));
  }
  BinaryLayout layout{.xyz = {{{0, record_bytes}, {4, record_bytes}, {8, record_bytes}}}};
  if (with_intensities) layout.intensity = {12, record_bytes};
  Scan scan = ReadBinary(layout, num_points, bytes);
  RETURN_IF_ERROR(CheckPlausible(scan, num_points));
  if (record_bytes == kRecordBytes) {
    RETURN_IF_ERROR(CheckIntensities(bytes));
  }
  return scan;
}

}  // namespace scanloc::dataset
