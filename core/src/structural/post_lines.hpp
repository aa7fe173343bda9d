#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scanloc/core/scan/structure.hpp"
#include "scanloc/core/structural/registration.hpp"

namespace scanloc {

/// Posts as points of lines: where a post's neighbours form a wall, a row or a hedge, the direction
/// across it. Posts stand a cell apart, but lines lie where they are to a few centimetres, and so
/// tell walls that are the same from walls that are alike. Immutable.
class PostLines {
 public:
  /// cell_m: PostParams::cell_m, by which the posts were found. Of posts that crowd as no scan's
  /// do, in a file that was made to, some are left out.
  PostLines(std::span<const Post> posts, double cell_m);

  /// The geometric mean of the shares of either's posts that lie within inlier_m of a line of the
  /// other's, where both lie best on each other, near the pose given (point-to-line ICP); in [0,
  /// 1], 0 where there are none.
  [[nodiscard]] double InlierRatioOn(const PostLines& place, const PlanarPose& T_place_these,
                                     double inlier_m) const;

 private:
  struct Line {
    float x_m = 0.0F;  ///< the post, moved onto the line through its neighbours
    float y_m = 0.0F;
    float across_x = 0.0F;  ///< a unit vector; 0: what stands here is too wide for a line
    float across_y = 0.0F;

    [[nodiscard]] bool is_line() const { return across_x != 0.0F || across_y != 0.0F; }
  };

  [[nodiscard]] Line LineAt(const Line& post) const;
  /// Calls visit(line) for each of those in the cells within reach of a point.
  template <typename Visitor>
  void VisitNear(float x_m, float y_m, float reach_m, const Visitor& visit) const;
  /// The line of the post nearest to a point, within reach; none: nullptr.
  [[nodiscard]] const Line* Nearest(float x_m, float y_m) const;
  /// Where these lie best on others, from a pose.
  [[nodiscard]] PlanarPose Refined(const PostLines& on, PlanarPose T_on_these,
                                   double inlier_m) const;
  /// The share of these within inlier_m of a line of others.
  [[nodiscard]] double ShareOn(const PostLines& on, const PlanarPose& T_on_these,
                               double inlier_m) const;

  double cell_m_;      // of the posts
  float grid_cell_m_;  // of the grid in which they are found again
  float least_x_m_ = 0.0F, least_y_m_ = 0.0F;
  int num_columns_ = 0, num_rows_ = 0;
  std::vector<std::uint32_t> begins_;  // of each cell, row by row; one more
  std::vector<Line> lines_;            // cell by cell
};

}  // namespace scanloc
