#include "structural/stands.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "scan/simd.hpp"

namespace scanloc {
namespace {

constexpr double kAlikeHeading = 0.7;  // cosine of the angle by which two places may be turned

SCANLOC_SIMD bool IsAnyNear(const double* __restrict x_m, const double* __restrict y_m,
                            const double* __restrict z_m, std::size_t num,
                            const double* __restrict at_m, double squared_m) {
  const double here_x_m = at_m[0];
  const double here_y_m = at_m[1];
  const double here_z_m = at_m[2];
  std::int64_t num_near = 0;
  for (std::size_t i = 0; i < num; ++i) {
    const double x = x_m[i] - here_x_m;
    const double y = y_m[i] - here_y_m;
    const double z = z_m[i] - here_z_m;
    num_near += x * x + y * y + z * z < squared_m ? 1 : 0;
  }
  return num_near > 0;
}

}  // namespace

void Stands::Add(const Pose& pose) {
  poses_.push_back(&pose);
  for (std::size_t axis = 0; axis < at_m_.size(); ++axis) {
    at_m_[axis].push_back(pose.translation()[static_cast<Eigen::Index>(axis)]);
  }
}

bool Stands::IsAnyBeside(const Pose& pose, double apart_m) const {
  // Mostly none is near at all. Rounding is not to decide.
  constexpr double kMore = 1.001;
  const Eigen::Vector3d at_m = pose.translation();
  if (!IsAnyNear(at_m_[0].data(), at_m_[1].data(), at_m_[2].data(), poses_.size(), at_m.data(),
                 kMore * apart_m * apart_m)) {
    return false;
  }
  return std::any_of(poses_.begin(), poses_.end(), [&](const Pose* other) {
    return (at_m - other->translation()).squaredNorm() < apart_m * apart_m &&
           pose.linear().cwiseProduct(other->linear()).sum() > 1.0 + 2.0 * kAlikeHeading;
  });
}

}  // namespace scanloc
