#pragma once

#include <span>

#include "scanloc/core/auto_params.hpp"
#include "scanloc/core/structural/registration.hpp"
#include "scanloc/core/structural/verify.hpp"
#include "structural/height_grid.hpp"
#include "structural/horizon.hpp"
#include "structural/post_lines.hpp"

namespace scanloc {

/// What a query and a place are laid on: more than a megabyte, made once and filled again and
/// again.
struct MatchGrids {
  explicit MatchGrids(const AutoParams& params);

  DistanceField coarse, fine;  ///< of the query
  DistanceField place;
  HeightGrid heights, place_heights;
};

/// One query laid on places, one after the other; one per query and thread.
class QueryMatch {
 public:
  /// Sensors are carried at sensor_height_m. Keeps nothing of the structure; uses the grids, of
  /// such parameters, for as long as it lives.
  QueryMatch(const Structure& query, const AutoParams& params, double sensor_height_m,
             MatchGrids& grids);

  [[nodiscard]] const AutoParams& params() const { return params_; }

  /// Moves the hypothesis to where some of its place's points lie best on the query, and scores
  /// it by these alone.
  void LayCoarsely(const PlanarPoints& place, const RegistrationParams& steps,
                   Hypothesis& hypothesis) const;

  /// The place that the following speak of.
  void SetPlace(const Structure& place);
  /// T_place_query where the query lies best on the place, from a guess within the first width,
  /// registered until it moves no more.
  [[nodiscard]] PlanarPose Settle(const PlanarPose& guess) const;
  /// The geometric mean of how much of the query lies on the place and how much of the place,
  /// within the query's reach, lies on the query, seen from above; in [0, 1].
  [[nodiscard]] double ScoreFromAbove(const PlanarPose& T_place_query) const;
  /// The mean of that and the same height by height, as VerificationParams::heights_share says. On
  /// stairs the ground is often a step's or a wall's, and so no height is known: where the query's
  /// is not at the sensor's height to a cell, what is seen from above says how likely the heights
  /// are to agree, and where the place's is not, they agree at least so well.
  [[nodiscard]] double Score(const PlanarPose& T_place_query) const;

  /// PostLines::InlierRatioOn of the query, if EvidenceParams::inliers_share asks for it, else 0.
  [[nodiscard]] double InlierRatio(const PostLines& place, const PlanarPose& T_place_query) const;
  /// The lines of a place for that; none if it is not asked for.
  [[nodiscard]] PostLines LinesOf(const Structure& place) const;

  /// What holds a pose where Settle has left it: Information, at the width of its last step.
  [[nodiscard]] Eigen::Matrix3d Information(const PlanarPose& T_place_query) const;

  /// SetPlace, Settle and Score.
  void LayFinely(const Structure& place, Hypothesis& hypothesis);

 private:
  /// Whether heights above the ground can be compared.
  [[nodiscard]] bool KnowsHeights(const Structure& structure) const;

  AutoParams params_;
  double sensor_height_m_;
  PlanarPoints query_;
  PlanarPoints few_;  // of these
  PostLines lines_;
  Horizon horizon_;
  MatchGrids& grids_;
  PlanarPoints place_;
  bool knows_heights_, knows_place_heights_ = false;
};

}  // namespace scanloc
