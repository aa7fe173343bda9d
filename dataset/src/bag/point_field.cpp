#include "bag/point_field.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "scanloc/core/byte_order.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::array<std::string_view, 5> kTimeNames = {"t", "time", "timestamp", "time_stamp",
                                                        "offset_time"};

template <typename Number>
double LoadAs(const char* bytes, bool big_endian) {
  return static_cast<double>(
      LoadNumber<Number>(bytes, big_endian ? std::endian::big : std::endian::little));
}

using Loader = double (*)(const char* bytes, bool big_endian);

struct Type {
  std::size_t size_bytes;
  Loader load;
};
// By number, as sensor_msgs/PointField has them.
constexpr std::array<Type, 9> kTypes = {{{0, nullptr},
                                         {1, &LoadAs<std::int8_t>},
                                         {1, &LoadAs<std::uint8_t>},
                                         {2, &LoadAs<std::int16_t>},
                                         {2, &LoadAs<std::uint16_t>},
                                         {4, &LoadAs<std::int32_t>},
                                         {4, &LoadAs<std::uint32_t>},
                                         {4, &LoadAs<float>},
                                         {8, &LoadAs<double>}}};

}  // namespace

std::size_t PointField::size_bytes() const {
  return type < kTypes.size() ? kTypes[type].size_bytes : 0;
}

NumberType TypeOf(const PointField& field) {
  if (field.is_float()) return FloatOf(field.size_bytes());
  return *WholeOf(field.size_bytes(), field.type % 2 == 1);
}

bool IsReadField(std::string_view name, bool with_intensities) {
  return name == "x" || name == "y" || name == "z" || (with_intensities && IsIntensity(name)) ||
         std::ranges::find(kTimeNames, name) != kTimeNames.end();
}

const PointField* FindTimes(const std::vector<PointField>& fields) {
  for (const PointField& field : fields) {
    const bool is_time = std::ranges::find(kTimeNames, field.name) != kTimeNames.end();
    if (is_time && field.size_bytes() >= 4) return &field;
  }
  return nullptr;
}

void AppendTimes(const PointField& field, const BinaryLayout& xyz, std::size_t num_points,
                 std::string_view bytes, std::vector<double>& values) {
  const Loader load = kTypes[field.type].load;
  const std::size_t step = xyz.xyz[0].stride_bytes;
  std::array<Loader, 3> load_xyz{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    load_xyz[axis] = xyz.xyz[axis].type == NumberType::kFloat64 ? &LoadAs<double> : &LoadAs<float>;
  }
  values.reserve(values.size() + num_points);
  for (std::size_t i = 0; i < num_points; ++i) {
    const char* const point = bytes.data() + i * step;
    bool is_finite = true;
    bool is_return = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // As a float: ReadBinary leaves out doubles beyond its range, too.
      const double value = load_xyz[axis](point + xyz.xyz[axis].offset_bytes, xyz.big_endian);
      is_finite &= std::abs(value) <= std::numeric_limits<float>::max();
      is_return |= value != 0.0;
    }
    if (!is_finite) continue;
    values.push_back(is_return ? load(point + field.offset, xyz.big_endian) : kNoTime);
  }
}

std::vector<float> OffsetsFromStamp(std::vector<double> values, std::int64_t stamp_ns) {
  constexpr double kShortest_s = 1e-3;
  // Seconds since 1970 beside zeros would, as nanoseconds, be a sweep of 1.7 s.
  constexpr double kLongest_s = 1.5;
  constexpr double kDay_s = 86400.0;
  // Drivers stamp a cloud with its first point, its last, or its arrival; farther off the times are
  // another clock's (PTP without the leap seconds), and would move points to where they never were.
  constexpr double kMostBeside_s = 0.25;
  std::vector<float> offsets_s;
  const auto told = std::ranges::find_if(values, [](double value) { return value != kNoTime; });
  if (told == values.end()) return offsets_s;
  std::ranges::replace(values, kNoTime, double{*told});
  if (!std::ranges::all_of(values, [](double value) { return std::isfinite(value); })) {
    return offsets_s;
  }
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const double stamp_s = 1e-9 * static_cast<double>(stamp_ns);
  for (const double unit_s : {1.0, 1e-6, 1e-9, 1e-3}) {
    const double sweep_s = (*most - *least) * unit_s;
    if (sweep_s < kShortest_s || sweep_s > kLongest_s) continue;
    const bool is_absolute = std::abs(*least * unit_s - stamp_s) < kDay_s && stamp_s > kDay_s;
    const double zero_s = is_absolute ? stamp_s : 0.0;
    if (*least * unit_s - zero_s > kMostBeside_s || *most * unit_s - zero_s < -kMostBeside_s) {
      continue;
    }
    offsets_s.reserve(values.size());
    for (const double value : values) {
      offsets_s.push_back(static_cast<float>(value * unit_s - zero_s));
    }
    return offsets_s;
  }
  return offsets_s;
}

}  // namespace scanloc::dataset
