#pragma once

#include <optional>
#include <span>

#include "scanloc/core/answer.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/eval/measures.hpp"
#include "scanloc/eval/recall_distribution.hpp"

namespace scanloc::eval {

/// What is true of one query.
struct QueryTruth {
  std::optional<Pose> T_map_query;         ///< none: taken elsewhere
  std::optional<RevisitVariance> nearest;  ///< as NearestPlace gives it
};

/// How far a pose is from the true one.
struct PoseError {
  double position_m = 0.0;  ///< in the plane
  double lateral_m = 0.0;   ///< of it, across the true heading
  double yaw_deg = 0.0;     ///< between the headings, in [0, 180]
};
[[nodiscard]] PoseError ErrorOf(const Pose& T_map_found, const Pose& T_map_true);

/// What one answer is worth.
struct Judgement {
  /// Right if the *place* of the best candidate lies within the limit of the query's true position
  /// (paper, Sec. "Correctness Criteria"); what the answer says of the pose changes nothing.
  ScoredQuery scored;
  /// Rank from 1 of the first candidate whose place lies within the limit; 0: none does.
  int first_right = 0;
  /// The *pose* of the best candidate lies within the limit of the true position: what a confidence
  /// speaks of.
  bool is_pose_right = false;
  /// The pose is right, though the query is no revisit: no place lies within the limit. Wrong as a
  /// match.
  bool is_right_beyond = false;
  /// Of the best candidate's pose, where the match is right.
  std::optional<PoseError> error;
};

/// Judges the candidates of one answer, best first. The score is the best one's confidence, where
/// it tells one, else one less its distance. Pure.
[[nodiscard]] Judgement Judge(const QueryTruth& truth, std::span<const Candidate> candidates,
                              double within_m);

}  // namespace scanloc::eval
