#include "structural/horizon.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanloc {
namespace {

/// Columns are seen from one visit and missed from the next by as much at the end of sight.
constexpr float kMargin_m = 2.0F;

// Sectors are half-open and count from the rear, counter-clockwise.
int SectorOf(float x_m, float y_m, int num_sectors) {
  const float turn = std::atan2(y_m, x_m) / (2.0F * std::numbers::pi_v<float>)+0.5F;
  return std::clamp(static_cast<int>(turn * static_cast<float>(num_sectors)), 0, num_sectors - 1);
}

}  // namespace

Horizon::Horizon(std::span<const Column> columns) {
  for (const Column& column : columns) {
    const float x_m = static_cast<float>(column.x_cm) * 0.01F;
    const float y_m = static_cast<float>(column.y_cm) * 0.01F;
    const float range_m = std::sqrt(x_m * x_m + y_m * y_m);
    // A sector's neighbours see as far: sectors are narrower than gaps between columns.
    const int sector = SectorOf(x_m, y_m, kNumSectors);
    for (const int near : {sector + kNumSectors - 1, sector, sector + 1}) {
      float& reach_m = reach_m_[static_cast<std::size_t>(near % kNumSectors)];
      reach_m = std::max(reach_m, range_m + kMargin_m);
    }
  }
}

std::vector<Column> Horizon::Within(std::span<const Column> columns,
                                    const PlanarPose& T_horizon_columns) const {
  const auto cosine = static_cast<float>(std::cos(T_horizon_columns.yaw_rad));
  const auto sine = static_cast<float>(std::sin(T_horizon_columns.yaw_rad));
  const auto origin_x_m = static_cast<float>(T_horizon_columns.x_m);
  const auto origin_y_m = static_cast<float>(T_horizon_columns.y_m);
  std::vector<Column> within;
  within.reserve(columns.size());
  for (const Column& column : columns) {
    const float given_x_m = static_cast<float>(column.x_cm) * 0.01F;
    const float given_y_m = static_cast<float>(column.y_cm) * 0.01F;
    const float x_m = cosine * given_x_m - sine * given_y_m + origin_x_m;
    const float y_m = sine * given_x_m + cosine * given_y_m + origin_y_m;
    const float reach_m = reach_m_[static_cast<std::size_t>(SectorOf(x_m, y_m, kNumSectors))];
    if (x_m * x_m + y_m * y_m < reach_m * reach_m) within.push_back(column);
  }
  return within;
}

}  // namespace scanloc
