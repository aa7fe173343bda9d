#include "scanloc/sim/lidar_sim.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <vector>

#include "absl/strings/str_cat.h"
#include "lidar/lidar_sim_hits.hpp"
#include "random.hpp"
#include "scanloc/core/status_macros.hpp"
#include "sim_text.hpp"

namespace scanloc::sim {
namespace {

/// What a column of beams must know to pass over a solid.
struct Candidate {
  float near_m;
  float slope_low;
  float slope_high;
  std::uint32_t seen;
};

Candidate MakeCandidate(const SeenSolid& seen, std::size_t index) {
  constexpr float kSlack = 1e-3F;  // rounding to float must not lose a hit
  const double near = std::max(seen.near_m, 1e-2);
  double high = seen.z_high / (seen.z_high > 0.0 ? near : seen.far_m);
  double low = seen.z_low / (seen.z_low < 0.0 ? near : seen.far_m);
  // Right above or below, it is hit by beams of any steepness.
  constexpr double kAny = std::numeric_limits<float>::infinity();
  if (seen.near_m < near && seen.z_high > 0.0) high = kAny;
  if (seen.near_m < near && seen.z_low < 0.0) low = -kAny;
  return {static_cast<float>(seen.near_m) - kSlack, static_cast<float>(low) - kSlack,
          static_cast<float>(high) + kSlack, static_cast<std::uint32_t>(index)};
}

/// The directions of one turn, and the lists of solids that each azimuth may see.
class Turn {
 public:
  Turn(const LidarOptions& options, const Pose& T_map_sensor)
      : options_(options), rotation_(T_map_sensor.linear()), sensor_(T_map_sensor.translation()) {
    const double step =
        Radians(options.max_elevation_deg - options.min_elevation_deg) / (options.num_rays - 1);
    for (int i = 0; i < options.num_rays; ++i) {
      elevations_.push_back(CosSin(Radians(options.min_elevation_deg) + i * step));
    }
    for (int i = 0; i < options.num_azimuths; ++i) {
      const double azimuth =
          (i + 0.5) * (2.0 * std::numbers::pi / options.num_azimuths) - std::numbers::pi;
      if (std::abs(azimuth) > 0.5 * Radians(options.fov_deg)) continue;
      azimuths_.push_back(CosSin(azimuth));
      first_azimuth_ = std::min(first_azimuth_, i);
    }
    MeasureHeadings();
  }

  void Spread(const std::vector<SeenSolid>& seen) {
    begins_.assign(azimuths_.size() + 1, 0);
    for (const SeenSolid& solid : seen) {
      VisitAzimuths(solid, [this](int azimuth) { ++begins_[azimuth + 1]; });
    }
    std::partial_sum(begins_.begin(), begins_.end(), begins_.begin());
    candidates_.resize(begins_.back());
    std::vector<std::size_t> ends(begins_.begin(), begins_.end() - 1);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const Candidate candidate = MakeCandidate(seen[i], i);
      VisitAzimuths(seen[i], [&](int azimuth) { candidates_[ends[azimuth]++] = candidate; });
    }
  }

  [[nodiscard]] int num_azimuths() const { return static_cast<int>(azimuths_.size()); }
  [[nodiscard]] int num_rays() const { return options_.num_rays; }
  [[nodiscard]] Eigen::Vector3d Direction(int azimuth, int ray) const {
    return {elevations_[ray].x() * azimuths_[azimuth].x(),
            elevations_[ray].x() * azimuths_[azimuth].y(), elevations_[ray].y()};
  }
  // By hand: how Eigen orders the sums depends on the instruction set.
  [[nodiscard]] Eigen::Vector3d InMap(const Eigen::Vector3d& d) const {
    const auto row = [&](int i) {
      return rotation_(i, 0) * d.x() + rotation_(i, 1) * d.y() + rotation_(i, 2) * d.z();
    };
    return {row(0), row(1), row(2)};
  }
  [[nodiscard]] const Eigen::Vector3d& sensor() const { return sensor_; }
  [[nodiscard]] std::span<const Candidate> Candidates(int azimuth) const {
    return std::span(candidates_)
        .subspan(begins_[azimuth], begins_[azimuth + 1] - begins_[azimuth]);
  }

 private:
  void MeasureHeadings() {
    const double tilt_rad = std::acos(std::clamp(rotation_(2, 2), -1.0, 1.0));
    const double steepest_deg =
        std::max(std::abs(options_.min_elevation_deg), std::abs(options_.max_elevation_deg));
    if (tilt_rad + Radians(steepest_deg) > Radians(88.0)) {
      slack_rad_ = std::numbers::pi;  // a beam of an azimuth may have any heading
      return;
    }
    heading_rad_ = std::atan2(rotation_(1, 0), rotation_(0, 0));
    // The heading of a tilted azimuth's beams changes monotonically with the elevation, so that the
    // outermost rays bound it.
    for (int i = 0; i < num_azimuths(); ++i) {
      const double azimuth = std::atan2(azimuths_[i].y(), azimuths_[i].x());
      for (const int ray : {0, num_rays() - 1}) {
        const Eigen::Vector3d d = InMap(Direction(i, ray));
        const double turned = std::remainder(std::atan2(d.y(), d.x()) - heading_rad_ - azimuth,
                                             2.0 * std::numbers::pi);
        slack_rad_ = std::max(slack_rad_, std::abs(turned));
      }
    }
    slack_rad_ += 1e-6;
  }
  template <typename Visitor>
  void VisitAzimuths(const SeenSolid& seen, Visitor&& visit) const {
    const int full_turn = options_.num_azimuths;
    const double step = 2.0 * std::numbers::pi / full_turn;
    const double half = seen.half_extent_rad + slack_rad_;
    // In steps from azimuth 0 of the full turn, which points backwards.
    const double center = (seen.azimuth_rad - heading_rad_ + std::numbers::pi) / step - 0.5;
    auto first = static_cast<std::int64_t>(std::ceil(center - half / step));
    auto last = static_cast<std::int64_t>(std::floor(center + half / step));
    last = std::min(last, first + full_turn - 1);
    for (std::int64_t i = first; i <= last; ++i) {
      const auto wrapped = static_cast<int>(((i % full_turn) + full_turn) % full_turn);
      const int kept = wrapped - first_azimuth_;
      if (kept >= 0 && kept < num_azimuths()) visit(kept);
    }
  }

  const LidarOptions& options_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d sensor_;
  std::vector<Eigen::Vector2d> elevations_;
  std::vector<Eigen::Vector2d> azimuths_;
  int first_azimuth_ = std::numeric_limits<int>::max();
  double heading_rad_ = 0.0;  // of the sensor's +x in the map
  double slack_rad_ = 0.0;    // how far tilt turns a beam away from its azimuth
  std::vector<std::size_t> begins_;
  std::vector<Candidate> candidates_;
};

std::vector<SeenSolid> NearestFirst(std::span<const Solid> solids, const Eigen::Vector3d& sensor,
                                    double max_range_m) {
  std::vector<SeenSolid> seen;
  seen.reserve(solids.size());
  for (std::size_t i = 0; i < solids.size(); ++i) {
    const double reach_m = max_range_m + solids[i].half_length_m + solids[i].half_width_m;
    if ((solids[i].center - sensor.head<2>()).squaredNorm() > reach_m * reach_m) continue;
    SeenSolid solid = See(solids[i], i, sensor);
    if (solid.near_m <= max_range_m) seen.push_back(solid);
  }
  std::ranges::sort(seen, [](const SeenSolid& a, const SeenSolid& b) {
    return a.near_m != b.near_m ? a.near_m < b.near_m : a.index < b.index;
  });
  return seen;
}

double CastBeam(const Turn& turn, const std::vector<SeenSolid>& seen, const Ground& ground,
                int azimuth, const Eigen::Vector3d& direction, double max_range_m,
                std::uint64_t bits) {
  const double horizontal =
      std::sqrt(direction.x() * direction.x() + direction.y() * direction.y());
  const auto slope = static_cast<float>(direction.z() / horizontal);
  double best = HitGround(ground, turn.sensor(), direction, max_range_m);
  for (const Candidate& candidate : turn.Candidates(azimuth)) {
    if (candidate.near_m > best * horizontal) break;
    if (slope < candidate.slope_low || slope > candidate.slope_high) continue;
    best = std::min(best, HitSolid(seen[candidate.seen], direction, bits));
  }
  return best;
}

}  // namespace

absl::Status Validate(const LidarOptions& options) {
  RETURN_IF_ERROR(CheckRange("num_rays", options.num_rays, 16, 128));
  RETURN_IF_ERROR(CheckRange("min_elevation_deg", options.min_elevation_deg, -50, 50));
  RETURN_IF_ERROR(CheckRange("max_elevation_deg", options.max_elevation_deg, -50, 50));
  if (options.max_elevation_deg <= options.min_elevation_deg) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_elevation_deg is ", NumberText(options.max_elevation_deg),
                     "; it must be greater than min_elevation_deg, which is ",
                     NumberText(options.min_elevation_deg)));
  }
  RETURN_IF_ERROR(CheckRange("num_azimuths", options.num_azimuths, 90, 4096));
  RETURN_IF_ERROR(CheckRange("fov_deg", options.fov_deg, 10, 360));
  RETURN_IF_ERROR(CheckRange("max_range_m", options.max_range_m, 5, 300));
  RETURN_IF_ERROR(CheckRange("range_sigma_m", options.range_sigma_m, 0, 1));
  return CheckRange("dropout", options.dropout, 0, 0.2);
}

PointCloud CastScan(const LidarOptions& options, const Ground& ground,
                    std::span<const Solid> solids, const Pose& T_map_sensor,
                    std::uint64_t noise_seed) {
  Turn turn(options, T_map_sensor);
  const std::vector<SeenSolid> seen = NearestFirst(solids, turn.sensor(), options.max_range_m);
  turn.Spread(seen);

  PointCloud scan;
  scan.reserve(static_cast<std::size_t>(turn.num_azimuths()) * turn.num_rays());
  const double range2 = options.max_range_m * options.max_range_m;
  for (int azimuth = 0; azimuth < turn.num_azimuths(); ++azimuth) {
    for (int ray = 0; ray < turn.num_rays(); ++ray) {
      const std::uint64_t bits =
          Mix(noise_seed, static_cast<std::uint64_t>(azimuth) * turn.num_rays() + ray);
      const Eigen::Vector3d direction = turn.Direction(azimuth, ray);
      const double hit =
          CastBeam(turn, seen, ground, azimuth, turn.InMap(direction), options.max_range_m, bits);
      if (hit >= options.max_range_m) continue;
      const double lost = options.dropout * (1.0 + 4.0 * hit * hit / range2);
      if (UnitInterval(Mix(bits, 0xD06)) < lost) continue;
      const double range = hit + options.range_sigma_m * BellShaped(bits);
      if (range <= 0.0 || range > options.max_range_m) continue;
      scan.push_back({static_cast<float>(direction.x() * range),
                      static_cast<float>(direction.y() * range),
                      static_cast<float>(direction.z() * range)});
    }
  }
  return scan;
}

}  // namespace scanloc::sim
