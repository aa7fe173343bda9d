#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/dataset/scan_reader.hpp"

namespace scanloc::dataset {

/// How the image of a scanning radar is laid out.
enum class RadarLayout {
  /// Polar, Oxford Radar RobotCar (and MulRan's polar_oxford_form): a row an azimuth, which begins
  /// with the time (8 bytes), the step of the encoder out of 5600 (2 bytes) and whether it was
  /// measured (0 or 255); then a column a step of range.
  kOxford,
  /// Polar, MulRan: a row a step of range, a column an azimuth, the first one ahead.
  kMulran,
  /// From above: the radar in the middle, ahead up, right to the right.
  kCartesian,
};

/// Metres a step of range; none for kCartesian, whose pixels are of any size.
[[nodiscard]] std::optional<double> DefaultResolution_m(RadarLayout layout);

/// Decodes an image: a point a pixel, of height 0 with the power received as its intensity;
/// azimuths turn clockwise as seen from above. InvalidArgument: no PNG, not of 8-bit greys, more
/// than limits::kMaxPointsPerScan pixels, damaged, or not of that layout.
[[nodiscard]] absl::StatusOr<Scan> DecodeRadar(std::string_view png, RadarLayout layout,
                                               double resolution_m);

/// The same of a file; errors with its path, and those of ReadScan.
[[nodiscard]] absl::StatusOr<Scan> ReadRadar(const std::string& path, RadarLayout layout,
                                             double resolution_m);

struct RadarFile {
  std::int64_t stamp_ns = 0;
  std::string path;
};
/// The .png of a folder by time, which their names give as those of scans do: 19 digits [ns] or 16
/// [µs]. NotFound: no such folder. InvalidArgument: none in it, or a name that is no time.
[[nodiscard]] absl::StatusOr<std::vector<RadarFile>> ListRadar(const std::string& folder);

}  // namespace scanloc::dataset
