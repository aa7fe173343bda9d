#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace scanloc {

/// One return of a LiDAR, in the sensor frame: x forward, y left, z up [m].
struct Point {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;

  friend bool operator==(const Point&, const Point&) = default;
};
static_assert(sizeof(Point) == 3 * sizeof(float), "points are sent and stored as packed x y z");

/// One scan, in the order in which the sensor or the file gave the points.
using PointCloud = std::vector<Point>;
using PointView = std::span<const Point>;

/// Points with other numbers between them, as in an N×4 array: x y z are the first of each row.
struct PointRows {
  const float* data = nullptr;
  std::size_t size = 0;    ///< rows
  std::size_t stride = 3;  ///< floats from one row to the next, at least 3
};

}  // namespace scanloc
