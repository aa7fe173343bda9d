#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include "scan_decoders.hpp"

namespace scanloc::dataset {

/// sensor_msgs/PointField.
struct PointField {
  std::string_view name;
  std::uint32_t offset = 0;
  std::uint8_t type = 0;

  /// 0 if the type is not known.
  [[nodiscard]] std::size_t size_bytes() const;
  [[nodiscard]] bool is_float() const { return type == 7 || type == 8; }
};

/// Whether a field of this name is read: a coordinate, a time or, if asked, an intensity.
[[nodiscard]] bool IsReadField(std::string_view name, bool with_intensities);

/// Of a type that is known.
[[nodiscard]] NumberType TypeOf(const PointField& field);

/// The field of the points' times; null if there is none.
[[nodiscard]] const PointField* FindTimes(const std::vector<PointField>& fields);

/// In place of the time of a point at the sensor itself: a beam without a return, of which many
/// drivers leave all fields at zero.
inline constexpr double kNoTime = -std::numeric_limits<double>::infinity();

/// Appends the values of a field, or kNoTime, for the points whose coordinates are finite.
void AppendTimes(const PointField& field, const BinaryLayout& xyz, std::size_t num_points,
                 std::string_view bytes, std::vector<double>& values);

/// Values of a field of times as seconds from the stamp. Of s, us, ns and ms the unit is taken in
/// which all lie within 1 ms to 1.5 s of each other; they are absolute if the first lies within a
/// day of the stamp, else from it. Empty if they are no times, or of a sweep that does not come
/// within 0.25 s of the stamp.
[[nodiscard]] std::vector<float> OffsetsFromStamp(std::vector<double> values,
                                                  std::int64_t stamp_ns);

}  // namespace scanloc::dataset
