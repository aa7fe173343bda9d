#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "scanloc/sim/town.hpp"

namespace scanloc::sim {

/// Footprints on the ground: what is taken by discs (streets, the way of a car) and by boxes
/// (buildings), and whether another box still fits. Only the footprints of solids are looked at; a
/// round one counts as its square.
class Site {
 public:
  /// Keeps discs of `radius_m` along the path free.
  void KeepFree(const Path& path, double radius_m);
  /// The same along a line `left_m` to the left of the path.
  void KeepFree(const Path& path, double radius_m, double left_m);

  /// Whether the footprint overlaps no disc, and no box taken comes closer than gap_m.
  [[nodiscard]] bool Fits(const Solid& solid, double gap_m) const;
  void Take(const Solid& solid);

 private:
  struct Disc {
    Eigen::Vector2d center;
    double radius_m;
  };
  template <typename Visitor>
  static void VisitAround(const Solid& solid, double reach_m, Visitor&& visit);

  double max_disc_m_ = 0.0;
  std::unordered_map<std::uint64_t, std::vector<Disc>> discs_;   // by the cell of the centre
  std::unordered_map<std::uint64_t, std::vector<Solid>> boxes_;  // by every cell that they touch
};

}  // namespace scanloc::sim
