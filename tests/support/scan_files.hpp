#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "scanloc/core/scan/point_cloud.hpp"

namespace scanloc::test {

/// Appends the bytes of a number, little endian.
template <typename T>
void AppendBytes(std::string& bytes, T value) {
  const auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  bytes.append(raw.data(), raw.size());
}

/// Appends the bytes of a number, big endian.
template <typename T>
void AppendBytesBigEndian(std::string& bytes, T value) {
  auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

/// A KITTI .bin file of the points, with intensity 0.5.
inline std::string KittiBytes(const PointCloud& points) {
  std::string bytes;
  for (const Point& p : points) {
    for (const float value : {p.x, p.y, p.z, 0.5F}) AppendBytes(bytes, value);
  }
  return bytes;
}

/// A NumPy file, version 1, with this dictionary as its header and these values.
inline std::string NpyBytes(const std::string& dictionary, const std::string& values) {
  std::string header = dictionary;
  while ((10 + header.size() + 1) % 64 != 0) header += ' ';
  header += '\n';
  std::string bytes = std::string("\x93NUMPY\x01\0", 8);
  AppendBytes(bytes, static_cast<std::uint16_t>(header.size()));
  return bytes + header + values;
}

/// A scan as NAVER LABS publishes it: float32 x y z intensity, in centimetres.
inline std::string NaverBytes(const PointCloud& points) {
  std::string values;
  for (const Point& p : points) {
    for (const float value : {100.0F * p.x, 100.0F * p.y, 100.0F * p.z, 7.0F}) {
      AppendBytes(values, value);
    }
  }
  return NpyBytes("{'descr': '<f4', 'fortran_order': False, 'shape': (" +
                      std::to_string(points.size()) + ", 4), }",
                  values);
}

/// A few points that are all different and exact in six decimal digits.
inline PointCloud SomePoints(std::size_t num_points) {
  PointCloud points;
  for (std::size_t i = 0; i < num_points; ++i) {
    const auto value = static_cast<float>(i);
    points.push_back({1.0F + value, -0.25F * value, 0.5F - 0.125F * value});
  }
  return points;
}

}  // namespace scanloc::test
