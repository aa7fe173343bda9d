#pragma once

#include <cstdint>
#include <vector>

#include "scanloc/core/auto_params.hpp"
#include "scanloc/core/structural/registration.hpp"
#include "structural/horizon.hpp"

namespace scanloc {

/// At which heights something stands around a scan's sensor, cell by cell of a grid in the plane.
/// Other scans' posts are laid on it.
class HeightGrid {
 public:
  explicit HeightGrid(const PostParams& params);

  /// Replaces what stands there. O(posts).
  void Fill(const PlanarPoints& posts, double sensor_height_m);

  /// Of the heights at which another scan's points have something, and which this scan's sensor
  /// could see there, the share at which this one has something in the same cell or the next, in
  /// [0, 1]; 0 where there are none. Beyond the horizon, if there is one, nothing counts.
  [[nodiscard]] double Overlap(const PlanarPoints& points, const PlanarPose& T_grid_points,
                               const Horizon* horizon) const;

 private:
  /// How steeply a sensor looks down and up, as its posts say: [m] a metre of range.
  void FindView(const PlanarPoints& posts);

  float cell_m_;
  int side_;
  float sensor_height_m_ = 0.0F;
  float lowest_slope_ = 0.0F, highest_slope_ = 0.0F;
  // What stands there and in the cells beside along the row. Rows beside are looked up where
  // another scan's points fall: a place is filled once and asked once or twice.
  std::vector<std::uint32_t> cells_;
  std::vector<std::uint32_t> touched_;  // the first of three that are not empty
};

}  // namespace scanloc
