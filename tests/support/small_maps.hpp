#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>

#include "absl/strings/str_format.h"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/mapdb/map_builder.hpp"

/// Maps small enough to try every byte of, and the made scans they are built of.
namespace scanloc::test {

inline Params SmallParams() {
  Params params;
  params.polar.num_rings = 4;
  params.polar.num_sectors = 6;
  params.cart.num_rows = 4;
  params.cart.num_cols = 6;
  params.cart.max_shift_cols = 2;
  return params;
}

/// A drive along a bend, 2 m and 0.1 s a scan.
inline mapdb::SessionPlan SmallPlan(const std::string& name, std::size_t num_scans) {
  mapdb::SessionPlan plan;
  plan.name = name;
  for (std::size_t i = 0; i < num_scans; ++i) {
    const double s = static_cast<double>(i);
    mapdb::PlannedScan scan;
    scan.name = absl::StrFormat("%06d.bin", i);
    scan.stamp_ns = 1'700'000'000'000'000'000 + static_cast<std::int64_t>(i) * 100'000'000;
    scan.T_map_place.translation() = Eigen::Vector3d(2.0 * s, 0.1 * s * s, -0.25);
    scan.T_map_place.linear() =
        Eigen::AngleAxisd(0.1 * s, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    plan.scans.push_back(scan);
  }
  return plan;
}

/// A scan of points all round, the same for the same seed on every machine.
inline PointCloud SmallScan(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto within = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(random() % 4096) / 4096.0F;
  };
  PointCloud points(200);
  for (Point& point : points) point = {within(-60, 60), within(-35, 35), within(-2, 8)};
  return points;
}

/// Loads SmallScan(seed + i) for scan i.
inline mapdb::ScanLoader SmallLoader(std::uint32_t seed = 1) {
  return [seed](std::size_t scan) -> absl::StatusOr<PointCloud> {
    return SmallScan(seed + static_cast<std::uint32_t>(scan));
  };
}

inline mapdb::BuildOptions SmallOptions(const std::string& path,
                                        mapdb::BuildMode mode = mapdb::BuildMode::kCreate) {
  mapdb::BuildOptions options;
  options.path = path;
  options.mode = mode;
  options.params = SmallParams();
  options.num_threads = 2;
  options.commit_interval = 3;
  return options;
}

/// Builds a map of one session.
inline absl::StatusOr<mapdb::BuildSummary> BuildSmallMap(const std::string& path,
                                                         std::size_t num_scans,
                                                         const std::string& session = "one",
                                                         std::uint32_t seed = 1) {
  return mapdb::BuildMap(SmallOptions(path), SmallPlan(session, num_scans), SmallLoader(seed));
}

}  // namespace scanloc::test
