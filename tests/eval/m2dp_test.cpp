#include "scanloc/eval/m2dp.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "scanloc/core/scan/voxel_filter.hpp"

namespace scanloc::eval {
namespace {

/// A made scan: walls of several lengths around the sensor, no symmetry.
PointCloud Scene(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  PointCloud points;
  for (int wall = 0; wall < 12; ++wall) {
    const double bearing = 6.28 * unit(random);
    const double range_m = 8.0 + 40.0 * unit(random);
    const double length_m = 4.0 + 20.0 * unit(random);
    const double height_m = 2.0 + 8.0 * unit(random);
    for (int i = 0; i < 400; ++i) {
      const double along_m = length_m * unit(random);
      points.push_back(
          {static_cast<float>(range_m * std::cos(bearing) - along_m * std::sin(bearing)),
           static_cast<float>(range_m * std::sin(bearing) + along_m * std::cos(bearing)),
           static_cast<float>(height_m * unit(random) - 1.7)});
    }
  }
  return points;
}

PointCloud Moved(const PointCloud& points, const Eigen::AngleAxisd& turn,
                 const Eigen::Vector3d& by_m) {
  PointCloud moved;
  for (const Point& point : points) {
    const Eigen::Vector3d p = turn * Eigen::Vector3d(point.x, point.y, point.z) + by_m;
    moved.push_back(
        {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
  }
  return moved;
}

PointCloud Moved(const PointCloud& points, double yaw_rad, const Eigen::Vector3d& by_m) {
  return Moved(points, Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()), by_m);
}

Eigen::Matrix3Xd Matrix(const PointCloud& points) {
  Eigen::Matrix3Xd matrix(3, static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < matrix.cols(); ++i) {
    const Point& p = points[static_cast<std::size_t>(i)];
    matrix.col(i) = Eigen::Vector3d(p.x, p.y, p.z);
  }
  return matrix;
}

TEST(M2dp, IsTwoUnitVectorsOfFixedLength) {
  M2dp m2dp;
  const Eigen::VectorXf descriptor = m2dp.Describe(Scene(1));
  ASSERT_EQ(descriptor.size(), 192);
  EXPECT_TRUE(descriptor.allFinite());
  EXPECT_NEAR(descriptor.head(64).norm(), 1.0F, 1e-5F);
  EXPECT_NEAR(descriptor.tail(128).norm(), 1.0F, 1e-5F);
  EXPECT_GE(descriptor.minCoeff(), -1e-6F) << "Perron's vectors of a matrix without negatives";
}

TEST(M2dp, GivesTheSameVectorAgain) {
  M2dp m2dp;
  EXPECT_EQ(m2dp.Describe(Scene(1)), m2dp.Describe(Scene(1)));
}

TEST(M2dp, HardlyChangesWhenTheCloudIsTurnedAndMoved) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const PointCloud scene = Scene(seed);
    const Eigen::MatrixXd signatures = M2dp::Signatures(Matrix(scene));
    const Eigen::MatrixXd moved =
        M2dp::Signatures(Matrix(Moved(scene, 0.7 * static_cast<double>(seed), {3.0, -2.0, 0.4})));
    // Points on the edge of a cell may fall to either side.
    EXPECT_LT((signatures - moved).cwiseAbs().sum() / M2dp::kNumPlanes, 0.01) << seed;
  }
}

/// Mean share of the points that fall into other cells.
double Difference(const PointCloud& a, const PointCloud& b) {
  return (M2dp::Signatures(Matrix(a)) - M2dp::Signatures(Matrix(b))).cwiseAbs().sum() /
         M2dp::kNumPlanes;
}

TEST(M2dp, HardlyChangesWhenTheCloudIsTurnedAboutAnyAxis) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const PointCloud scene = Scene(seed);
    const Eigen::Vector3d axis =
        Eigen::Vector3d(unit(random), unit(random), unit(random)).normalized();
    const double angle_rad = 3.0 * unit(random);
    EXPECT_LT(Difference(scene, Moved(scene, Eigen::AngleAxisd(angle_rad, axis), {0, 0, 0})), 0.01)
        << seed;
    // Upside down: the third axis points the other way, which no moment of it decides.
    EXPECT_LT(Difference(scene, Moved(scene, Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()),
                                      {0, 0, 0})),
              0.01)
        << seed;
  }
}

TEST(M2dp, HardlyChangesWhenTheCloudIsMoved) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const PointCloud scene = Scene(seed);
    EXPECT_LT(Difference(scene, Moved(scene, 0.0, {20.0, -35.0, 4.0})), 0.01) << seed;
  }
}

TEST(M2dp, IsNotTheSameForTheMirroredCloud) {
  PointCloud mirrored = Scene(1);
  for (Point& point : mirrored) point.y = -point.y;
  EXPECT_GT(Difference(Scene(1), mirrored), 0.1);
}

/// The first singular vectors by iteration from a vector without negatives, whose limit has none.
TEST(M2dp, IsTheFirstSingularVectorsWithPositiveSigns) {
  M2dp m2dp;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const PointCloud scene = Scene(seed);
    VoxelFilter filter(M2dp::kVoxelSize_m);
    const Eigen::MatrixXd signatures = M2dp::Signatures(Matrix(filter.Apply(scene)));
    Eigen::VectorXd left = Eigen::VectorXd::Ones(M2dp::kNumPlanes).normalized();
    for (int i = 0; i < 500; ++i)
      left = (signatures * (signatures.transpose() * left)).normalized();
    const Eigen::VectorXd right = (signatures.transpose() * left).normalized();
    const Eigen::VectorXd descriptor = m2dp.Describe(scene).cast<double>();
    EXPECT_LT((descriptor.head(M2dp::kNumPlanes) - left).norm(), 1e-4) << seed;
    EXPECT_LT((descriptor.tail(M2dp::kNumCells) - right).norm(), 1e-4) << seed;
  }
}

TEST(M2dp, TellsScenesApartBetterThanItChangesWithTheVoxelsOfAMove) {
  M2dp m2dp;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const PointCloud scene = Scene(seed);
    const Eigen::VectorXf descriptor = m2dp.Describe(scene);
    const float same = (descriptor - m2dp.Describe(Moved(scene, 1.1, {0.4, 0.3, 0.0}))).norm();
    const float other = (descriptor - m2dp.Describe(Scene(seed + 100))).norm();
    EXPECT_LT(3.0F * same, other) << seed;
  }
}

/// By the words of the paper, one point and one plane at a time, without shared intermediates.
TEST(M2dp, CountsAsTheSlowWayDoes) {
  const Eigen::Matrix3Xd points = Matrix(Scene(3));
  const Eigen::MatrixXd signatures = M2dp::Signatures(points);
  ASSERT_EQ(signatures.rows(), 64);
  ASSERT_EQ(signatures.cols(), 128);
  const Eigen::Vector3d mean = points.rowwise().mean();
  const Eigen::Matrix3Xd centred = points.colwise() - mean;
  const Eigen::JacobiSVD<Eigen::Matrix3Xd> svd(centred, Eigen::ComputeThinU);
  Eigen::Vector3d x = svd.matrixU().col(0);
  Eigen::Vector3d y = svd.matrixU().col(1);
  const auto third_moment = [&](const Eigen::Vector3d& axis) {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < centred.cols(); ++i) sum += std::pow(axis.dot(centred.col(i)), 3);
    return sum;
  };
  if (third_moment(x) < 0.0) x = -x;
  if (third_moment(y) < 0.0) y = -y;
  const Eigen::Vector3d z = x.cross(y);
  double farthest = 0.0;
  for (Eigen::Index i = 0; i < centred.cols(); ++i) {
    farthest = std::max(farthest, centred.col(i).norm());
  }
  double difference = 0.0;
  for (int plane = 0; plane < 64; ++plane) {
    const double azimuth = (plane / 16) * M_PI / 4.0;
    const double elevation = (plane % 16) * M_PI / 32.0;
    const Eigen::Vector3d normal = std::cos(azimuth) * std::cos(elevation) * x +
                                   std::sin(azimuth) * std::cos(elevation) * y +
                                   std::sin(elevation) * z;
    Eigen::Vector3d right = plane == 0 ? y : x;
    right = (right - right.dot(normal) * normal).normalized();
    const Eigen::Vector3d up = normal.cross(right);
    Eigen::VectorXd counts = Eigen::VectorXd::Zero(128);
    for (Eigen::Index i = 0; i < centred.cols(); ++i) {
      const double across = right.dot(centred.col(i));
      const double along = up.dot(centred.col(i));
      const double range = std::hypot(across, along);
      int ring = 7;
      for (int j = 7; j >= 0; --j) {
        if (range < (j + 1) * (j + 1) * farthest / 64.0) ring = j;
      }
      const double degrees = std::atan2(along, across) * 180.0 / M_PI + 180.0;
      counts(ring * 16 + static_cast<int>(degrees / 22.5) % 16) += 1.0;
    }
    difference += (counts.transpose() / static_cast<double>(centred.cols()) - signatures.row(plane))
                      .cwiseAbs()
                      .sum();
  }
  EXPECT_LT(difference / 64.0, 1e-3);
}

TEST(M2dp, GivesZeroForScansWithoutShape) {
  M2dp m2dp;
  PointCloud line;
  for (int i = 0; i < 100; ++i) line.push_back({0.5F * static_cast<float>(i), 0.0F, 0.0F});
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const PointCloud& scan :
       {PointCloud(), PointCloud{{1.0F, 2.0F, 3.0F}}, PointCloud(500, {1.0F, 2.0F, 3.0F}), line,
        PointCloud(10, {nan, nan, nan})}) {
    const Eigen::VectorXf descriptor = m2dp.Describe(scan);
    ASSERT_EQ(descriptor.size(), 192);
    EXPECT_TRUE(descriptor.isZero());
  }
}

TEST(M2dp, FindsThePlaceOfALikeScanAndNothingForAScanWithoutShape) {
  Map map;
  std::vector<Eigen::VectorXf> vectors;
  M2dp m2dp;
  for (std::uint64_t place = 0; place < 4; ++place) {
    map.places.push_back({.T_map_place = PlanarOffset(5.0 * static_cast<double>(place), 0.0)});
    vectors.push_back(m2dp.Describe(place == 2 ? PointCloud() : Scene(place + 1)));
  }
  m2dp.Prepare(map, vectors);
  const ScanDescriptor unused;
  const PointCloud scan = Moved(Scene(4), 1.0, {0.2, 0.1, 0.0});
  const Answer answer = m2dp.Recognize({.scan = scan, .descriptor = unused, .num_answers = 10});
  ASSERT_EQ(answer.candidates.size(), 3U) << "all but the one that could not be described";
  EXPECT_EQ(answer.candidates[0].place, 3);
  EXPECT_TRUE(answer.candidates[0].T_map_place.isApprox(map.places[3].T_map_place));
  for (const Candidate& candidate : answer.candidates) EXPECT_NE(candidate.place, 2);
  const PointCloud empty;
  EXPECT_TRUE(
      m2dp.Recognize({.scan = empty, .descriptor = unused, .num_answers = 10}).candidates.empty())
      << "two scans without shape are not the same place";
}

}  // namespace
}  // namespace scanloc::eval
