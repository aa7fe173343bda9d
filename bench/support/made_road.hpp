#pragma once

#include <cstdint>
#include <vector>

#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc::bench {

/// A winding road without end, with walls, trees and poles on both sides that are drawn anew all
/// along it, and scans of it without ray casting: the visible upper parts of what stands around,
/// and the ground. Fast enough for maps of millions of places, and no two spots of it are alike but
/// by chance. The same seed gives the same road. Thread-safe.
class MadeRoad {
 public:
  explicit MadeRoad(std::uint64_t seed) : seed_(seed) {}

  /// T_map_sensor of a vehicle so far along the road and so far left of its middle.
  [[nodiscard]] Pose PoseAt(double along_m, double left_m = 0.0, bool reverse = false) const;

  /// Where the scan of a place, or of a later visit, is taken.
  struct Visit {
    double along_m = 0.0;
    double left_m = 0.0;
    bool reverse = false;
    std::uint64_t session =
        0;  ///< 0: as mapped; other sessions find a share of it gone, moved or new
  };
  /// In the sensor frame, 1.8 m above the ground.
  [[nodiscard]] PointCloud Scan(const Visit& visit) const;

 private:
  struct Thing;
  /// What stands along so many metres of the road, by its number.
  void AppendThings(std::int64_t block, std::uint64_t session, std::vector<Thing>& things) const;

  std::uint64_t seed_;
};

}  // namespace scanloc::bench
