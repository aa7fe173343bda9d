#include "scanloc/eval/m2dp.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "scanloc/core/scan/voxel_filter.hpp"

namespace scanloc::eval {
namespace {

constexpr double kPi = std::numbers::pi;
/// Clouds narrower than this across their longest axis have no second one [m].
constexpr double kLeastSpread_m = 1e-3;

/// Columns: the axes of the cloud's own frame, right-handed. Zero if it has only one.
Eigen::Matrix3d PrincipalAxes(const Eigen::Matrix3Xd& centred) {
  const Eigen::Matrix3d covariance =
      centred * centred.transpose() / static_cast<double>(centred.cols());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  if (!(solver.eigenvalues()(1) > kLeastSpread_m * kLeastSpread_m)) return Eigen::Matrix3d::Zero();
  Eigen::Matrix3d axes;
  for (int i = 0; i < 2; ++i) {
    Eigen::Vector3d axis = solver.eigenvectors().col(2 - i);  // eigenvalues come in rising order
    if ((axis.transpose() * centred).array().cube().sum() < 0.0) axis = -axis;
    axes.col(i) = axis;
  }
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

/// Rings from the inside, where ring j reaches from j² to (j + 1)² times the width of the first.
int RingOf(double squared_radius, double ring_m) {
  const double squared_rings = squared_radius / (ring_m * ring_m);
  int ring = 0;
  for (int j = 1; j < M2dp::kNumRings; ++j) ring += squared_rings >= j * j * j * j ? 1 : 0;
  return ring;
}

/// Sectors from -x counter-clockwise: that within a quadrant by the slope, without an arc tangent.
int SectorOf(double x, double y) {
  constexpr int kPerQuadrant = M2dp::kNumSectors / 4;
  static_assert(kPerQuadrant == 4);
  constexpr double kSlopes[kPerQuadrant - 1] = {std::numbers::sqrt2 - 1.0, 1.0,
                                                std::numbers::sqrt2 + 1.0};
  const double width = std::fabs(x);
  const double height = std::fabs(y);
  int within = 0;
  for (const double slope : kSlopes) within += height >= slope * width ? 1 : 0;
  const int half = y < 0.0 ? 0 : 2 * kPerQuadrant;
  return half + ((x < 0.0) == (y < 0.0) ? within : 2 * kPerQuadrant - 1 - within);
}

/// Counts the projection onto the plane in rings and sectors.
Eigen::RowVectorXd CountOnPlane(const Eigen::Matrix3Xd& points, const Eigen::Vector3d& normal,
                                double ring_m) {
  Eigen::Vector3d x_axis = Eigen::Vector3d::UnitX() - normal.x() * normal;
  if (x_axis.norm() < 1e-9) x_axis = Eigen::Vector3d::UnitY() - normal.y() * normal;
  x_axis.normalize();
  const Eigen::Vector3d y_axis = normal.cross(x_axis);
  Eigen::RowVectorXd counts = Eigen::RowVectorXd::Zero(M2dp::kNumCells);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const double x = x_axis.dot(points.col(i));
    const double y = y_axis.dot(points.col(i));
    counts(RingOf(x * x + y * y, ring_m) * M2dp::kNumSectors + SectorOf(x, y)) += 1.0;
  }
  return counts / static_cast<double>(points.cols());
}

Eigen::VectorXf WithPositiveSum(const Eigen::VectorXd& vector) {
  return (vector.sum() < 0.0 ? Eigen::VectorXd(-vector) : vector).cast<float>();
}

}  // namespace

Eigen::MatrixXd M2dp::Signatures(const Eigen::Matrix3Xd& points) {
  if (points.cols() < 3) return {};
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::Matrix3d axes = PrincipalAxes(centred);
  if (axes.isZero()) return {};
  const Eigen::Matrix3Xd turned = axes.transpose() * centred;
  const double radius_m = std::sqrt(turned.colwise().squaredNorm().maxCoeff());
  const double ring_m = radius_m / (kNumRings * kNumRings);
  Eigen::MatrixXd signatures(kNumPlanes, kNumCells);
  for (int a = 0; a < kNumAzimuths; ++a) {
    for (int e = 0; e < kNumElevations; ++e) {
      const double azimuth = a * kPi / kNumAzimuths;
      const double elevation = e * kPi / (2 * kNumElevations);
      const Eigen::Vector3d normal(std::cos(azimuth) * std::cos(elevation),
                                   std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
      signatures.row(a * kNumElevations + e) = CountOnPlane(turned, normal, ring_m);
    }
  }
  return signatures;
}

Eigen::VectorXf M2dp::Describe(PointView scan) const {
  thread_local VoxelFilter filter(kVoxelSize_m);  // keeps its tables from scan to scan
  const PointCloud& voxels = filter.Apply(scan);
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(voxels.size()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Point& point = voxels[static_cast<std::size_t>(i)];
    points.col(i) = Eigen::Vector3d(point.x, point.y, point.z);
  }
  const Eigen::MatrixXd signatures = Signatures(points);
  if (signatures.size() == 0) return Eigen::VectorXf::Zero(kLength);
  // Only the first singular vectors are asked for: the left one is the last eigenvector of S·Sᵀ.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(signatures * signatures.transpose());
  const Eigen::VectorXd left = solver.eigenvectors().rightCols<1>();
  const Eigen::VectorXd right = (signatures.transpose() * left).normalized();
  Eigen::VectorXf descriptor(kLength);
  descriptor << WithPositiveSum(left), WithPositiveSum(right);
  return descriptor;
}

}  // namespace scanloc::eval
