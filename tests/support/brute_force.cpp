#include "support/brute_force.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

namespace scanloc::brute_force {
namespace {

using Matrix = std::vector<std::vector<double>>;

double HeightAboveGround_m(const Point& p, const Params& params) {
  return std::max(0.0, static_cast<double>(p.z) + params.sensor_height_m);
}

bool IsFinite(const Point& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

}  // namespace

Matrix VoxelCentroids(PointView scan, double voxel_size_m) {
  struct Sum {
    double x = 0.0, y = 0.0, z = 0.0, n = 0.0;
  };
  const auto index = [&](float v) {
    const double bin = std::floor(std::abs(static_cast<double>(v)) / voxel_size_m);
    return std::signbit(v) ? -1.0 - bin : bin;
  };
  std::map<std::array<double, 3>, Sum> voxels;
  for (const Point& p : scan) {
    if (!IsFinite(p)) continue;
    Sum& sum = voxels[{index(p.x), index(p.y), index(p.z)}];
    sum.x += p.x;
    sum.y += p.y;
    sum.z += p.z;
    sum.n += 1.0;
  }
  Matrix centroids;
  for (const auto& [key, sum] : voxels) {
    centroids.push_back({sum.x / sum.n, sum.y / sum.n, sum.z / sum.n});
  }
  return centroids;
}

Matrix PolarHeights_m(PointView points, const Params& params, double root_shift_m) {
  const PolarParams& polar = params.polar;
  Matrix heights(polar.num_rings, std::vector<double>(polar.num_sectors, 0.0));
  for (const Point& p : points) {
    if (!IsFinite(p)) continue;
    const double x = p.x;
    const double y = p.y - root_shift_m;
    const double range_m = std::hypot(x, y);
    if (range_m >= polar.max_range_m) continue;
    double azimuth_rad = std::atan2(y, x);
    if (azimuth_rad < 0.0) azimuth_rad += 2.0 * std::numbers::pi;
    const int ring = static_cast<int>(range_m / polar.max_range_m * polar.num_rings);
    const int sector =
        static_cast<int>(azimuth_rad / (2.0 * std::numbers::pi) * polar.num_sectors) %
        polar.num_sectors;
    double& cell = heights[ring][sector];
    cell = std::max(cell, HeightAboveGround_m(p, params));
  }
  return heights;
}

Matrix CartHeights_m(PointView points, const Params& params) {
  const CartParams& cart = params.cart;
  Matrix heights(cart.num_rows, std::vector<double>(cart.num_cols, 0.0));
  for (const Point& p : points) {
    if (!IsFinite(p)) continue;
    if (std::abs(p.x) >= cart.max_x_m || std::abs(p.y) >= cart.max_y_m) continue;
    const int row = static_cast<int>((p.x + cart.max_x_m) / (2.0 * cart.max_x_m) * cart.num_rows);
    const int col = static_cast<int>((p.y + cart.max_y_m) / (2.0 * cart.max_y_m) * cart.num_cols);
    double& cell = heights[row][col];
    cell = std::max(cell, HeightAboveGround_m(p, params));
  }
  return heights;
}

double Distance(const ContextView& query, const ContextView& place, int shift, ShiftMode mode) {
  const int num_cols = place.num_cols;
  double sum = 0.0;
  int num_columns = 0;
  for (int j = 0; j < num_cols; ++j) {
    int query_col = j - shift;
    if (mode == ShiftMode::kCircular) query_col = ((query_col % num_cols) + num_cols) % num_cols;
    double qp = 0.0;
    double qq = 0.0;
    double pp = 0.0;
    for (int r = 0; r < place.num_rows; ++r) {
      const bool outside = query_col < 0 || query_col >= num_cols;
      const double q = outside ? 0.0 : query.cells_cm[query_col * place.num_rows + r];
      const double p = place.cells_cm[j * place.num_rows + r];
      qp += q * p;
      qq += q * q;
      pp += p * p;
    }
    if (qq == 0.0 && pp == 0.0) continue;
    ++num_columns;
    sum += qq == 0.0 || pp == 0.0 ? 1.0 : 1.0 - qp / std::sqrt(qq * pp);
  }
  return num_columns == 0 ? 1.0 : sum / num_columns;
}

}  // namespace scanloc::brute_force
