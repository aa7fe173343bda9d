#pragma once

#include <array>
#include <span>

#include "scan/bearing.hpp"
#include "scanloc/core/scan/structure.hpp"

namespace scanloc {

/// How far a scan sees something upright, by azimuth. What another scan has beyond that neither
/// speaks for nor against the two being of one place (OverlapWithin).
class Horizon {
 public:
  static constexpr int kNumSectors = 72;
  static int SectorOf(float x, float y) { return SectorFromRear(x, y, kNumSectors); }

  /// Beyond the farthest post in a direction the margin is still in sight.
  Horizon(std::span<const Post> posts, double margin_m);

  /// By sector; 0 where nothing was seen.
  [[nodiscard]] std::span<const float> reach_squared_m() const { return reach_squared_m_; }

 private:
  std::array<float, kNumSectors> reach_squared_m_{};
};

}  // namespace scanloc
