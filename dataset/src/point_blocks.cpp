#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "scan_decoders.hpp"
#include "scanloc/core/byte_order.hpp"

namespace scanloc::dataset {
namespace {

bool IsFinite(const Point& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

template <typename Number>
Number Load(const char* bytes, bool big_endian) {
  return LoadNumber<Number>(bytes, big_endian ? std::endian::big : std::endian::little);
}

// A cast of a double beyond the range of float is undefined; no LiDAR gives one either.
float ToFloat(double value) {
  if (std::abs(value) > std::numeric_limits<float>::max()) {
    return std::numeric_limits<float>::infinity();
  }
  return static_cast<float>(value);
}

template <bool kBigEndian>
float LoadCoordinate(const char* bytes, const Coordinate& coordinate, std::size_t point) {
  bytes += coordinate.offset_bytes + point * coordinate.stride_bytes;
  switch (coordinate.type) {
    case NumberType::kFloat64:
      return ToFloat(Load<double>(bytes, kBigEndian));
    case NumberType::kInt8:
      return Load<std::int8_t>(bytes, kBigEndian);
    case NumberType::kUint8:
      return Load<std::uint8_t>(bytes, kBigEndian);
    case NumberType::kInt16:
      return Load<std::int16_t>(bytes, kBigEndian);
    case NumberType::kUint16:
      return Load<std::uint16_t>(bytes, kBigEndian);
    case NumberType::kInt32:
      return static_cast<float>(Load<std::int32_t>(bytes, kBigEndian));
    case NumberType::kUint32:
      return static_cast<float>(Load<std::uint32_t>(bytes, kBigEndian));
    default:
      return Load<float>(bytes, kBigEndian);
  }
}

float CheckedIntensity(float value) { return std::isfinite(value) && value > 0.0F ? value : 0.0F; }

// Of the points that are kept.
template <bool kBigEndian>
std::vector<float> ReadIntensities(const BinaryLayout& layout, std::size_t num_points,
                                   std::string_view bytes) {
  std::vector<float> intensities;
  intensities.reserve(num_points);
  for (std::size_t i = 0; i < num_points; ++i) {
    const auto load = [&](const Coordinate& coordinate) {
      return LoadCoordinate<kBigEndian>(bytes.data(), coordinate, i);
    };
    if (!IsFinite({load(layout.xyz[0]), load(layout.xyz[1]), load(layout.xyz[2])})) continue;
    intensities.push_back(CheckedIntensity(load(*layout.intensity)));
  }
  return intensities;
}

template <typename LoadPoint>
Scan ReadBlock(std::size_t num_points, const LoadPoint& load) {
  Scan scan;
  // Written without a branch and cut to length at the end; push_back takes twice as long.
  scan.points.resize(num_points);
  std::size_t num_finite = 0;
  for (std::size_t i = 0; i < num_points; ++i) {
    const Point point = load(i);
    scan.points[num_finite] = point;
    num_finite += IsFinite(point) ? 1 : 0;
  }
  scan.points.resize(num_finite);
  scan.num_not_finite = num_points - num_finite;
  return scan;
}

absl::Status BadRow(const LineReader& lines, std::string_view reason) {
  return absl::InvalidArgumentError(
      absl::StrCat("line ", lines.line_number(), ": ", ToAbsl(reason)));
}

}  // namespace

absl::StatusOr<Scan> ReadTextRows(const RowLayout& layout, std::size_t num_rows,
                                  LineReader& lines) {
  // The shortest row is one digit and one blank a column: announced rows that cannot be there must
  // not be reserved.
  if (num_rows > (lines.rest().size() + 1) / 2 / layout.num_columns) {
    return absl::InvalidArgumentError(absl::StrCat("truncated: the header announces ", num_rows,
                                                   " points, but only ", lines.rest().size(),
                                                   " bytes follow it"));
  }
  Scan scan;
  scan.points.reserve(num_rows);
  Tokens tokens;
  for (std::size_t row = 0; row < num_rows;) {
    const std::optional<std::string_view> line = lines.Next();
    if (!line) {
      return absl::InvalidArgumentError(absl::StrCat("truncated: the header announces ", num_rows,
                                                     " points, but only ", row, " rows follow it"));
    }
    SplitAtBlanks(*line, tokens);
    if (tokens.empty()) continue;
    if (tokens.size() != layout.num_columns) {
      return BadRow(lines, absl::StrCat("has ", tokens.size(), " values; the header announces ",
                                        layout.num_columns));
    }
    std::array<float, 3> xyz{};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::string_view token = tokens[layout.xyz[i]];
      if (!absl::SimpleAtof(ToAbsl(token), &xyz[i])) {
        return BadRow(lines, absl::StrCat(Quote(token), " is not a number"));
      }
    }
    const Point point{xyz[0], xyz[1], xyz[2]};
    float intensity = 0.0F;
    if (layout.intensity && !absl::SimpleAtof(ToAbsl(tokens[*layout.intensity]), &intensity)) {
      return BadRow(lines, absl::StrCat(Quote(tokens[*layout.intensity]), " is not a number"));
    }
    if (IsFinite(point)) {
      scan.points.push_back(point);
      if (layout.intensity) scan.intensities.push_back(CheckedIntensity(intensity));
    } else {
      ++scan.num_not_finite;
    }
    ++row;
  }
  return scan;
}

namespace {

Scan ReadPoints(const BinaryLayout& layout, std::size_t num_points, std::string_view bytes) {
  // Not by a structured binding: clang 14 lets no lambda have one.
  const Coordinate x = layout.xyz[0];
  const Coordinate y = layout.xyz[1];
  const Coordinate z = layout.xyz[2];
  const char* const data = bytes.data();
  if (layout.big_endian) {
    return ReadBlock(num_points, [&](std::size_t i) -> Point {
      return {LoadCoordinate<true>(data, x, i), LoadCoordinate<true>(data, y, i),
              LoadCoordinate<true>(data, z, i)};
    });
  }
  // As most sensors have it.
  const auto is_plain = [&](const Coordinate& c) {
    return c.type == NumberType::kFloat32 && c.stride_bytes == x.stride_bytes;
  };
  if (is_plain(x) && is_plain(y) && is_plain(z)) {
    const std::size_t step = x.stride_bytes;
    return ReadBlock(num_points, [=](std::size_t i) -> Point {
      const char* const at = data + i * step;
      return {Load<float>(at + x.offset_bytes, false), Load<float>(at + y.offset_bytes, false),
              Load<float>(at + z.offset_bytes, false)};
    });
  }
  return ReadBlock(num_points, [&](std::size_t i) -> Point {
    return {LoadCoordinate<false>(data, x, i), LoadCoordinate<false>(data, y, i),
            LoadCoordinate<false>(data, z, i)};
  });
}

}  // namespace

Scan ReadBinary(const BinaryLayout& layout, std::size_t num_points, std::string_view bytes) {
  Scan scan = ReadPoints(layout, num_points, bytes);
  if (layout.intensity) {
    scan.intensities = layout.big_endian ? ReadIntensities<true>(layout, num_points, bytes)
                                         : ReadIntensities<false>(layout, num_points, bytes);
  }
  return scan;
}

}  // namespace scanloc::dataset
