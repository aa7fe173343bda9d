#include "scanloc/core/map/spacing.hpp"

namespace scanloc {

std::vector<std::size_t> SelectBySpacing(std::span<const Pose> poses, double spacing_m) {
  constexpr double kSlack_m = 1e-3;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!kept.empty()) {
      const Eigen::Vector3d moved_m = poses[i].translation() - poses[kept.back()].translation();
      if (moved_m.norm() < spacing_m - kSlack_m) continue;
    }
    kept.push_back(i);
  }
  return kept;
}

}  // namespace scanloc
