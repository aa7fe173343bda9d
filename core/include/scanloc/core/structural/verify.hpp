#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scanloc/core/search_control.hpp"
#include "scanloc/core/structural/registration.hpp"

namespace scanloc {

/// A guess where a query was taken: near which place, and how it lies in that place's levelled
/// frame.
struct Hypothesis {
  std::int32_t place = 0;
  PlanarPose T_place_query;
  double score = 0.0;  ///< agreement of the posts, [0, 1]; see Verify
};

struct VerifyOptions {
  int num_fine = 16;  ///< hypotheses that the fine pass looks at
  /// Of hypotheses nearer to each other than rival_radius_m, at most this many reach the fine pass,
  /// so that a rival elsewhere gets its chance.
  int max_fine_per_spot = 4;
  double rival_radius_m = 8.0;
};

/// The places that hypotheses speak of.
class PlaceStructures {
 public:
  virtual ~PlaceStructures() = default;
  /// The posts of a place, in its levelled frame; valid until the next call.
  [[nodiscard]] virtual std::span<const Post> Posts(std::int32_t place) = 0;
  /// Where a query that lies so on a place would be in the map [m].
  [[nodiscard]] virtual Eigen::Vector2d PositionInMap(std::int32_t place,
                                                      const PlanarPose& T_place_query) = 0;
};

/// Lays the query's posts on those of each hypothesis' place, coarsely for all, finely for the
/// best; gives the finely verified ones, best first. Hypotheses are looked at in the order given
/// until the search is over; those of one place should follow each other.
///
/// The score is the geometric mean of how much of the query lies on the place and how much of the
/// place, within the query's reach, lies on the query.
[[nodiscard]] std::vector<Hypothesis> Verify(std::span<const Post> query,
                                             std::vector<Hypothesis> hypotheses,
                                             PlaceStructures& places, const SearchControl& control,
                                             const VerifyOptions& options = {});

}  // namespace scanloc
