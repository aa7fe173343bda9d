#include <cmath>

#include "absl/strings/str_cat.h"
#include "scan_decoders.hpp"
#include "scanloc/core/limits.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::size_t kRecordBytes = 16;
constexpr std::string_view kOtherLayouts =
    "; scanloc reads float32 x y z intensity. Another layout, such as NCLT's velodyne_sync (packed "
    "integers) or rows of five floats, must be converted first";

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

absl::StatusOr<Scan> DecodeKittiBin(std::string_view bytes) {
  if (bytes.size() % kRecordBytes != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("its ", bytes.size(), " bytes are not a multiple of ", kRecordBytes,
                     ": truncated or not a KITTI scan", ToAbsl(kOtherLayouts)));
  }
  const std::size_t num_points = bytes.size() / kRecordBytes;
  if (num_points > limits::kMaxPointsPerScan) {
    return absl::InvalidArgumentError(absl::StrCat(
        "holds ", num_points, " points; a scan has at most ", limits::kMaxPointsPerScan));
  }
  const BinaryLayout layout{.xyz = {{{0, kRecordBytes}, {4, kRecordBytes}, {8, kRecordBytes}}}};
  Scan scan = ReadBinary(layout, num_points, bytes);
  if (absl::Status status = CheckPlausible(scan, num_points); !status.ok()) return status;
  return scan;
}

}  // namespace scanloc::dataset
