#include "scanloc/dataset/deskew.hpp"

#include <algorithm>
#include <cmath>

namespace scanloc::dataset {

bool Deskew(const PoseAt& pose_at, std::int64_t stamp_ns, const std::vector<float>& offsets_s,
            PointCloud& points) {
  // A sweep of 0.1 s at 30 m/s is then off by at most 1 cm.
  constexpr std::size_t kNumSlots = 128;
  if (offsets_s.empty()) return true;
  const std::optional<Pose> T_map_stamp = pose_at(stamp_ns);
  if (!T_map_stamp) return false;
  const auto [least, most] = std::minmax_element(offsets_s.begin(), offsets_s.end());
  const double first_s = *least;
  const double slot_s = std::max(1e-9, (static_cast<double>(*most) - first_s) / kNumSlots);
  std::vector<Eigen::Isometry3f> moves;
  moves.reserve(kNumSlots);
  for (std::size_t slot = 0; slot < kNumSlots; ++slot) {
    const double middle_s = first_s + (static_cast<double>(slot) + 0.5) * slot_s;
    const std::optional<Pose> pose =
        pose_at(stamp_ns + static_cast<std::int64_t>(std::llround(1e9 * middle_s)));
    if (!pose) return false;
    moves.emplace_back((T_map_stamp->inverse() * *pose).cast<float>());
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double slot = (static_cast<double>(offsets_s[i]) - first_s) / slot_s;
    const Eigen::Isometry3f& move =
        moves[std::min(kNumSlots - 1, static_cast<std::size_t>(std::max(0.0, slot)))];
    const Eigen::Vector3f moved = move * Eigen::Vector3f(points[i].x, points[i].y, points[i].z);
    points[i] = {moved.x(), moved.y(), moved.z()};
  }
  return true;
}

}  // namespace scanloc::dataset
