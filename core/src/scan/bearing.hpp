#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace scanloc {

/// Minimax polynomial of the arc tangent over [0, 1]: of odd powers.
inline constexpr std::array<float, 6> kArcTangent = {0.99997726F,  -0.33262347F, 0.19354346F,
                                                     -0.11643287F, 0.05265332F,  -0.0117212F};

/// The sector that a direction falls into, of num_sectors that count from the rear,
/// counter-clockwise. The azimuth is good to 1e-5 rad. Not std::atan2, so that loops over it become
/// vectors, of the same bits on any processor.
inline int SectorFromRear(float x, float y, int num_sectors) {
  constexpr float kPi = std::numbers::pi_v<float>;
  const float along = std::abs(x);
  const float across = std::abs(y);
  const float greater = std::max(along, across);
  const float ratio = std::min(along, across) / std::max(greater, 1e-30F);
  const float square = ratio * ratio;
  const auto& c = kArcTangent;
  const float arc =
      ratio *
      (c[0] +
       square * (c[1] + square * (c[2] + square * (c[3] + square * (c[4] + square * c[5])))));
  // Without branches, else the compiler makes no vectors of it.
  const float is_steep = across > along ? 1.0F : 0.0F;
  const float quarter_rad = arc + is_steep * (kPi / 2.0F - 2.0F * arc);
  const float is_behind = x < 0.0F ? 1.0F : 0.0F;
  const float azimuth_rad = std::copysign(quarter_rad + is_behind * (kPi - 2.0F * quarter_rad), y);
  const auto sector =
      static_cast<int>((azimuth_rad * (0.5F / kPi) + 0.5F) * static_cast<float>(num_sectors));
  return std::min(std::max(sector, 0), num_sectors - 1);
}

}  // namespace scanloc
