#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scanloc/core/auto_params.hpp"
#include "scanloc/core/search_control.hpp"
#include "scanloc/core/structural/registration.hpp"

namespace scanloc {

/// A guess where a query was taken: near which place, and how it lies in that place's levelled
/// frame.
struct Hypothesis {
  std::int32_t place = 0;
  PlanarPose T_place_query;
  double score = 0.0;  ///< agreement of the posts, [0, 1]; see QueryMatch
  /// Looked at whatever else a query asks for: more candidates, or where a robot should be.
  bool is_usual = true;
};

/// A pose as who stands upright in the map tells it.
struct UprightPose {
  Eigen::Vector2d plane_m = Eigen::Vector2d::Zero();  ///< across the map's up direction
  double height_m = 0.0;                              ///< along it
  double heading_rad = 0.0;                           ///< about it
};

/// The places that hypotheses speak of.
class PlaceStructures {
 public:
  virtual ~PlaceStructures() = default;
  /// That of a place; valid as long as this.
  [[nodiscard]] virtual const Structure& Of(std::int32_t place) = 0;
  /// Where a query that lies so on a place would be in the map.
  [[nodiscard]] virtual UprightPose Upright(std::int32_t place,
                                            const PlanarPose& T_place_query) = 0;
};

/// Whether a hypothesis stands where another one of its place does.
[[nodiscard]] bool HasMet(const Hypothesis& hypothesis, std::span<const Hypothesis> others,
                          const VerificationParams& params);

class QueryMatch;

/// Lays the query on each hypothesis' place, coarsely for all, finely for the best; gives the
/// finely verified ones, best first. Hypotheses are looked at in the order given until the
/// search is over; those of one place should follow each other.
[[nodiscard]] std::vector<Hypothesis> Verify(QueryMatch& query, std::vector<Hypothesis> hypotheses,
                                             PlaceStructures& places, const SearchControl& control,
                                             const SelectionParams& selection);

}  // namespace scanloc
