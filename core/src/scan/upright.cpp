#include "scan/upright.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace scanloc {
namespace {

constexpr int kNumDraws = 500;
constexpr int kNumTries = 60;  // for a point that is neither too near nor too far
constexpr double kMaxShareBelowUpright = 0.2;
/// Fewer are no ground.
constexpr int kMinOn = 30;
/// How far the sensor's height above the ground may be from what is stated.
constexpr double kHeightShare = 0.25;
/// Of another plane that faces another way: with so much of the best one's voxels it is a rival.
constexpr double kRivalShare = 0.7;
constexpr double kOtherWay_rad = 20.0 * std::numbers::pi / 180.0;

constexpr float kOn_m = 0.15F;      // voxels on a plane that is drawn
constexpr float kAboutOn_m = 0.3F;  // on one that is fitted, whose error grows with distance
constexpr float kBelow_m = 0.6F;    // clearly below it: more than kerbs and steps
constexpr double kHeightSlack_m = 0.25;

/// Lengths that grow with what is seen.
struct Lengths {
  explicit Lengths(const GroundParams& params)
      : reach_m(static_cast<float>(params.reach_m)),
        near_m(0.5F * reach_m),
        least_apart_m(0.35F * static_cast<float>(params.cell_m)),
        most_apart_m(2.0F * static_cast<float>(params.cell_m)) {}

  float reach_m;                      ///< the ground is taken to be a plane
  float near_m;                       ///< points that planes are drawn by
  float least_apart_m, most_apart_m;  ///< those of one draw
};

/// The voxels in reach, one array a coordinate.
struct Points {
  std::vector<float> x, y, z;

  explicit Points(const PointCloud& voxels, float reach_m) {
    for (const Point& p : voxels) {
      if (!(p.x * p.x + p.y * p.y + p.z * p.z < reach_m * reach_m)) continue;
      x.push_back(p.x);
      y.push_back(p.y);
      z.push_back(p.z);
    }
  }
  [[nodiscard]] std::size_t size() const { return x.size(); }
  [[nodiscard]] Eigen::Vector3f at(std::size_t i) const { return {x[i], y[i], z[i]}; }
};

/// How many points lie on a plane, and how many clearly below it.
struct Counts {
  int num_on = 0;
  int num_below = 0;

  void Add(const Point& p, const Eigen::Vector3f& normal, float height_m, float on_m, int weight) {
    const float above_m = normal.x() * p.x + normal.y() * p.y + normal.z() * p.z + height_m;
    num_on += std::fabs(above_m) < on_m ? weight : 0;
    num_below += above_m < -kBelow_m ? weight : 0;
  }
};

Counts CountAround(const Points& points, const Eigen::Vector3f& normal, float height_m) {
  Counts counts;
  for (std::size_t i = 0; i < points.size(); ++i) {
    counts.Add({points.x[i], points.y[i], points.z[i]}, normal, height_m, kOn_m, 1);
  }
  return counts;
}

/// Draws of points, the same numbers on every machine.
class Draws {
 public:
  Draws(const Points& points, const Lengths& lengths) : points_(points), lengths_(lengths) {}

  Eigen::Vector3f Any() { return points_.at(static_cast<std::size_t>(random_() % points_.size())); }
  std::optional<Eigen::Vector3f> Beside(const Eigen::Vector3f& first) {
    for (int i = 0; i < kNumTries; ++i) {
      const Eigen::Vector3f point = Any();
      const float apart_m = (point - first).norm();
      if (apart_m > lengths_.least_apart_m && apart_m < lengths_.most_apart_m) return point;
    }
    return std::nullopt;
  }

 private:
  const Points& points_;
  const Lengths& lengths_;
  std::mt19937_64 random_{1};
};

struct GroundCandidate {
  Eigen::Vector3f normal;
  float height_m;
  int num_on;
  bool is_clear;  ///< next to nothing lies below

  [[nodiscard]] bool IsRivalOf(const GroundCandidate& best) const {
    const auto other_way = static_cast<float>(std::cos(kOtherWay_rad));
    const float cosine = normal.dot(best.normal);
    // A ceiling is as clear as a floor, and clearer than a ramp or a landing.
    const bool is_other = is_clear ? cosine < other_way : cosine < -other_way;
    return is_other && num_on > kRivalShare * best.num_on;
  }
};

/// Planes as far from the sensor as what it stands on.
std::vector<GroundCandidate> DrawGrounds(const Points& points, const Points& near,
                                         const Lengths& lengths, double sensor_height_m) {
  const double slack_m = std::max(kHeightSlack_m, kHeightShare * sensor_height_m);
  const float least_area_m2 = lengths.least_apart_m * lengths.least_apart_m;
  std::vector<GroundCandidate> candidates;
  Draws draws(near, lengths);
  for (int i = 0; i < kNumDraws; ++i) {
    const Eigen::Vector3f first = draws.Any();
    const auto second = draws.Beside(first);
    const auto third = draws.Beside(first);
    if (!second || !third) continue;
    Eigen::Vector3f normal = (*second - first).cross(*third - first);
    const float area = normal.norm();
    if (area < least_area_m2) continue;  // next to a line
    normal /= area;
    float height_m = -normal.dot(first);
    if (height_m < 0.0F) {
      normal = -normal;
      height_m = -height_m;
    }
    if (std::abs(height_m - sensor_height_m) > slack_m) continue;
    const Counts counts = CountAround(points, normal, height_m);
    if (counts.num_on < kMinOn) continue;
    candidates.push_back({normal, height_m, counts.num_on,
                          counts.num_below <= kMaxShareBelowUpright * counts.num_on});
  }
  return candidates;
}

}  // namespace

RollPitch LeanOf(const GroundPlane& plane) {
  return {.roll_rad = std::atan2(plane.normal.y(), plane.normal.z()),
          .pitch_rad = -std::asin(std::clamp(plane.normal.x(), -1.0, 1.0))};
}

double ShareBelow(const PointCloud& voxels, const GroundPlane& plane, const GroundParams& params) {
  const float reach_m = Lengths(params).reach_m;
  const Eigen::Vector3f normal = plane.normal.cast<float>();
  const auto height_m = static_cast<float>(plane.height_m);
  Counts counts;
  for (const Point& p : voxels) {
    const bool is_near = p.x * p.x + p.y * p.y + p.z * p.z < reach_m * reach_m;
    counts.Add(p, normal, height_m, kAboutOn_m, is_near ? 1 : 0);
  }
  if (counts.num_on < params.min_cells) return std::numeric_limits<double>::infinity();
  return static_cast<double>(counts.num_below) / counts.num_on;
}

std::optional<GroundPlane> SearchGround(const PointCloud& voxels, const GroundParams& params,
                                        double sensor_height_m) {
  const Lengths lengths(params);
  const Points points(voxels, lengths.reach_m);
  const Points near(voxels, lengths.near_m);
  if (near.size() < static_cast<std::size_t>(kMinOn)) return std::nullopt;
  const std::vector<GroundCandidate> candidates =
      DrawGrounds(points, near, lengths, sensor_height_m);
  const auto best = std::max_element(
      candidates.begin(), candidates.end(), [](const GroundCandidate& a, const GroundCandidate& b) {
        return std::pair(a.is_clear, a.num_on) < std::pair(b.is_clear, b.num_on);
      });
  if (best == candidates.end() || !best->is_clear) return std::nullopt;
  const bool has_rival =
      std::any_of(candidates.begin(), candidates.end(),
                  [&](const GroundCandidate& other) { return other.IsRivalOf(*best); });
  if (has_rival) return std::nullopt;
  return GroundPlane{best->normal.cast<double>().normalized(), best->height_m};
}

}  // namespace scanloc
