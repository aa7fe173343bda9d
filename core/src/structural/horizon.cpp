#include "structural/horizon.hpp"

#include <algorithm>
#include <cmath>

namespace scanloc {

Horizon::Horizon(std::span<const Post> posts, double margin_m) {
  for (const Post& post : posts) {
    const float x_m = static_cast<float>(post.x_cm) * 0.01F;
    const float y_m = static_cast<float>(post.y_cm) * 0.01F;
    const float reach_m = std::sqrt(x_m * x_m + y_m * y_m) + static_cast<float>(margin_m);
    // A sector's neighbours see as far: sectors are narrower than gaps between posts.
    const int sector = SectorOf(x_m, y_m);
    for (const int near : {sector + kNumSectors - 1, sector, sector + 1}) {
      float& farthest = reach_squared_m_[static_cast<std::size_t>(near % kNumSectors)];
      farthest = std::max(farthest, reach_m * reach_m);
    }
  }
}

}  // namespace scanloc
