#pragma once

#include <vector>

#include "scanloc/sim/simulated_drive.hpp"
#include "scanloc/sim/town.hpp"

namespace scanloc::sim {

/// Signed distance of the driven line from the route's centre line, to the left [m].
[[nodiscard]] double DrivenOffset(const SessionOptions& options);

/// What stands still during one session only: parked vehicles, and the changeable things that are
/// there. Nothing stands in the way of the session's own vehicle.
[[nodiscard]] std::vector<Solid> MakeStandingTraffic(const Town& town,
                                                     const SessionOptions& options);

/// The moving vehicles of one session.
class MovingTraffic {
 public:
  MovingTraffic(const Town& town, const SessionOptions& options);

  /// Appends the vehicles within radius_m of the session's own vehicle at a time. A vehicle that
  /// would overlap it is left out.
  void AppendAround(const Eigen::Vector2d& own, const Eigen::Vector2d& own_axis, double radius_m,
                    double time_s, std::vector<Solid>& to) const;

 private:
  struct Vehicle {
    double start_m;    // along its street at time 0
    double speed_mps;  // along the street's direction; negative for the opposite lanes
    double offset_m;   // of its lane, to the left of the centre line
    std::uint64_t seed;
  };
  struct TrafficOn {
    const Street* street;
    Eigen::Vector2d middle;
    double reach_m;
    std::vector<Vehicle> vehicles;
  };

  const Ground& ground_;
  std::vector<TrafficOn> streets_;
};

}  // namespace scanloc::sim
