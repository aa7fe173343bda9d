#include "scanloc/core/map/up.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "absl/strings/str_format.h"

namespace scanloc {
namespace {

/// More say no more. Taken at steps that double, so that a map that grows seldom says anew.
constexpr std::size_t kMaxNormals = 1024;

constexpr double kAgrees_rad = std::numbers::pi / 6.0;

double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

absl::StatusOr<Eigen::Vector3d> FindUp(const Map& map) {
  std::vector<Eigen::Vector3d> normals;
  const std::size_t num_places = std::min(map.grounds.size(), map.places.size());
  std::size_t step = 1;
  while (num_places / step > kMaxNormals) step *= 2;
  for (std::size_t i = 0; i < num_places; i += step) {
    if (!map.grounds[i].has_posts) continue;  // its ground may not have been found either
    normals.emplace_back(map.places[i].T_map_place.linear() *
                         LevelFromSensor(map.grounds[i].ground).linear().transpose().col(2));
  }
  if (normals.empty()) return Eigen::Vector3d::UnitZ();
  // The mean, then drawn to where most are: a few bad grounds must not tilt it.
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& normal : normals) up += normal;
  constexpr int kIterations = 10;
  for (int i = 0; i < kIterations && up.norm() > 1e-6; ++i) {
    up.normalize();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& normal : normals) {
      const double scaled = AngleBetween(normal, up) / kAgrees_rad;
      sum += normal / (1.0 + scaled * scaled);
    }
    up = sum;
  }
  std::size_t num_agreeing = 0;
  if (up.norm() > 1e-6) {
    up.normalize();
    for (const Eigen::Vector3d& normal : normals) {
      if (AngleBetween(normal, up) < kAgrees_rad) ++num_agreeing;
    }
  }
  if (2 * num_agreeing < normals.size()) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "the ground that the scans see says of no direction of the map that it is up: at most %d "
        "of %d places agree within 30°; check which frame the poses are of (camera or LiDAR), and "
        "the order of their quaternions",
        num_agreeing, normals.size()));
  }
  return up;
}

}  // namespace scanloc
