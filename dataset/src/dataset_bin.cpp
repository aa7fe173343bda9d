#include <cstdint>

#include "absl/strings/str_cat.h"
#include "dataset_frames.hpp"
#include "scan_decoders.hpp"
#include "scanloc/core/byte_order.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"

// Packed scans of datasets that have a layout of their own.

namespace scanloc::dataset {
namespace {

absl::StatusOr<std::size_t> CountRecords(std::string_view bytes, std::size_t record_bytes,
                                         std::string_view layout) {
  if (bytes.size() % record_bytes != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("its ", bytes.size(), " bytes are not a multiple of ", record_bytes,
                     ": truncated or not of the layout of ", ToAbsl(layout)));
  }
  const std::size_t num_points = bytes.size() / record_bytes;
  if (num_points > limits::kMaxPointsPerScan) {
    return absl::InvalidArgumentError(absl::StrCat(
        "holds ", num_points, " points; a scan has at most ", limits::kMaxPointsPerScan));
  }
  return num_points;
}

}  // namespace

absl::StatusOr<Scan> DecodeNcltSync(std::string_view bytes, bool with_intensities) {
  constexpr std::size_t kRecordBytes = 8;
  ASSIGN_OR_RETURN(const auto num_points, CountRecords(bytes, kRecordBytes, "NCLT velodyne_sync"));
  Scan scan;
  scan.points.reserve(num_points);
  for (std::size_t i = 0; i < num_points; ++i) {
    const auto value_m = [&](std::size_t column) {
      return 0.005 * LoadNumber<std::uint16_t>(bytes.data() + i * kRecordBytes + 2 * column) -
             100.0;
    };
    const Eigen::Vector3d point =
        Eigen::Vector3d(value_m(0), value_m(1), value_m(2)) - kNcltSensor_m;
    scan.points.push_back({static_cast<float>(point.x()), static_cast<float>(-point.y()),
                           static_cast<float>(-point.z())});
    if (with_intensities) {
      const auto intensity = static_cast<unsigned char>(bytes[i * kRecordBytes + 6]);
      scan.intensities.push_back(intensity);
    }
  }
  return scan;
}

absl::StatusOr<Scan> DecodeOxford(std::string_view bytes, bool is_left, bool with_intensities) {
  constexpr std::size_t kValueBytes = sizeof(float);
  ASSIGN_OR_RETURN(const auto num_points,
                   CountRecords(bytes, 4 * kValueBytes, "Oxford Radar RobotCar"));
  const std::size_t row_bytes = num_points * kValueBytes;
  BinaryLayout layout{
      .xyz = {{{0, kValueBytes}, {row_bytes, kValueBytes}, {2 * row_bytes, kValueBytes}}}};
  if (with_intensities) layout.intensity = {3 * row_bytes, kValueBytes};
  Scan scan = ReadBinary(layout, num_points, bytes);
  const Mount& mount = is_left ? kOxfordLeft : kOxfordRight;
  const Pose T_merged_mount = Eigen::Translation3d(-OxfordSensor_m()) * InOxfordIns(mount);
  for (Point& point : scan.points) {
    const Eigen::Vector3d moved = T_merged_mount * Eigen::Vector3d(point.x, point.y, point.z);
    point = {static_cast<float>(moved.x()), static_cast<float>(-moved.y()),
             static_cast<float>(-moved.z())};
  }
  return scan;
}

}  // namespace scanloc::dataset
