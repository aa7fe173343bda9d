#pragma once

#include <cstdint>
#include <random>

#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"

/// Made scans for tests; the same seed gives the same points.
namespace scanloc::scenes {

/// num_points points spread over ±range_m in x and y and from the ground to 12 m above the sensor.
inline PointCloud RandomScan(std::uint64_t seed, std::size_t num_points, float range_m = 90.0F) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(random() >> 40) / static_cast<float>(1 << 24);
  };
  PointCloud scan(num_points);
  for (Point& p : scan)
    p = {uniform(-range_m, range_m), uniform(-range_m, range_m), uniform(-2, 12)};
  return scan;
}

/// Flat ground 2 m below the sensor and num_posts posts 4 m high on it, within ±range_m.
inline PointCloud PostScan(std::uint64_t seed, int num_posts, float range_m = 45.0F) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(random() >> 40) / static_cast<float>(1 << 24);
  };
  PointCloud scan;
  for (int i = 0; i < 2000; ++i) {
    scan.push_back({uniform(-range_m, range_m), uniform(-range_m, range_m), -2.0F});
  }
  for (int i = 0; i < num_posts; ++i) {
    const float x_m = uniform(-range_m, range_m);
    const float y_m = uniform(-range_m, range_m);
    for (int k = 0; k <= 12; ++k) {
      scan.push_back({x_m, y_m, -2.0F + 4.0F * static_cast<float>(k) / 12.0F});
    }
  }
  return scan;
}

/// The scan as seen from a sensor at T_old_new in the old sensor's frame.
inline PointCloud SeenFrom(const PointCloud& scan, const Pose& T_old_new) {
  const Eigen::Isometry3f T_new_old = T_old_new.inverse().cast<float>();
  PointCloud seen;
  seen.reserve(scan.size());
  for (const Point& p : scan) {
    const Eigen::Vector3f q = T_new_old * Eigen::Vector3f(p.x, p.y, p.z);
    seen.push_back({q.x(), q.y(), q.z()});
  }
  return seen;
}

/// The scan of the same vehicle turned by exactly π: x and y negated.
inline PointCloud Reversed(PointCloud scan) {
  for (Point& p : scan) p = {-p.x, -p.y, p.z};
  return scan;
}

}  // namespace scanloc::scenes
