#include "structural/horizon.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanloc {
namespace {

// Sectors are half-open and count from the rear, counter-clockwise.
int SectorOf(float x_m, float y_m, int num_sectors) {
  const float turn = std::atan2(y_m, x_m) / (2.0F * std::numbers::pi_v<float>)+0.5F;
  return std::clamp(static_cast<int>(turn * static_cast<float>(num_sectors)), 0, num_sectors - 1);
}

}  // namespace

Horizon::Horizon(std::span<const Post> posts, double margin_m) {
  for (const Post& post : posts) {
    const float x_m = static_cast<float>(post.x_cm) * 0.01F;
    const float y_m = static_cast<float>(post.y_cm) * 0.01F;
    const float range_m = std::sqrt(x_m * x_m + y_m * y_m);
    // A sector's neighbours see as far: sectors are narrower than gaps between posts.
    const int sector = SectorOf(x_m, y_m, kNumSectors);
    for (const int near : {sector + kNumSectors - 1, sector, sector + 1}) {
      float& reach_m = reach_m_[static_cast<std::size_t>(near % kNumSectors)];
      reach_m = std::max(reach_m, range_m + static_cast<float>(margin_m));
    }
  }
}

std::vector<Post> Horizon::Within(std::span<const Post> posts,
                                  const PlanarPose& T_horizon_posts) const {
  const auto cosine = static_cast<float>(std::cos(T_horizon_posts.yaw_rad));
  const auto sine = static_cast<float>(std::sin(T_horizon_posts.yaw_rad));
  const auto origin_x_m = static_cast<float>(T_horizon_posts.x_m);
  const auto origin_y_m = static_cast<float>(T_horizon_posts.y_m);
  std::vector<Post> within;
  within.reserve(posts.size());
  for (const Post& post : posts) {
    const float given_x_m = static_cast<float>(post.x_cm) * 0.01F;
    const float given_y_m = static_cast<float>(post.y_cm) * 0.01F;
    const float x_m = cosine * given_x_m - sine * given_y_m + origin_x_m;
    const float y_m = sine * given_x_m + cosine * given_y_m + origin_y_m;
    const float reach_m = reach_m_[static_cast<std::size_t>(SectorOf(x_m, y_m, kNumSectors))];
    if (x_m * x_m + y_m * y_m < reach_m * reach_m) within.push_back(post);
  }
  return within;
}

}  // namespace scanloc
