#pragma once

#include <span>

#include "scanloc/core/auto_params.hpp"
#include "scanloc/core/structural/registration.hpp"
#include "scanloc/core/structural/verify.hpp"
#include "structural/horizon.hpp"

namespace scanloc {

/// One query laid on places, one after the other. Holds the query's distance fields and one for a
/// place; one per query and thread.
class QueryMatch {
 public:
  /// Keeps nothing of the posts.
  QueryMatch(std::span<const Post> query, const AutoParams& params);

  [[nodiscard]] const AutoParams& params() const { return params_; }

  /// Moves the hypothesis to where some of its place's points lie best on the query, and scores
  /// it by these alone.
  void LayCoarsely(const PlanarPoints& place, const RegistrationParams& steps,
                   Hypothesis& hypothesis) const;

  /// The place that the following speak of.
  void SetPlace(std::span<const Post> posts);
  /// T_place_query where the query lies best on the place, from a guess within the first width,
  /// registered until it moves no more.
  [[nodiscard]] PlanarPose Settle(const PlanarPose& guess) const;
  /// The geometric mean of how much of the query lies on the place and how much of the place,
  /// within the query's reach, lies on the query.
  [[nodiscard]] double Score(const PlanarPose& T_place_query) const;

  /// What holds a pose where Settle has left it: Information, at the width of its last step.
  [[nodiscard]] Eigen::Matrix3d Information(const PlanarPose& T_place_query) const;

  /// SetPlace, Settle and Score.
  void LayFinely(std::span<const Post> place, Hypothesis& hypothesis);

 private:
  AutoParams params_;
  PlanarPoints query_;
  PlanarPoints few_;  // of these
  Horizon horizon_;
  DistanceField coarse_;
  DistanceField fine_;
  DistanceField place_field_;
  PlanarPoints place_;
};

}  // namespace scanloc
