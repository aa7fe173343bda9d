#pragma once

#include <array>
#include <span>
#include <vector>

#include "scanloc/core/structural/registration.hpp"

namespace scanloc {

/// How far a scan sees something upright, by azimuth. What another scan has beyond that neither
/// speaks for nor against the two being of one place.
class Horizon {
 public:
  /// Beyond the farthest post in a direction the margin is still in sight.
  Horizon(std::span<const Post> posts, double margin_m);

  /// Those of another scan's posts that lie within sight.
  [[nodiscard]] std::vector<Post> Within(std::span<const Post> posts,
                                         const PlanarPose& T_horizon_posts) const;

 private:
  static constexpr int kNumSectors = 72;

  std::array<float, kNumSectors> reach_m_{};  // 0 where nothing was seen
};

}  // namespace scanloc
