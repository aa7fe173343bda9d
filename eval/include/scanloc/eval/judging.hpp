#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "scanloc/core/answer.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
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
  PoseDifference off;
  double lateral_m = 0.0;  ///< of off.plane_m, across the true heading
};
[[nodiscard]] PoseError ErrorOf(const Pose& T_map_found, const Pose& T_map_true);

/// An answer is right if its pose lies within PoseLimits of the truth in plane, height and heading.
[[nodiscard]] inline bool IsRight(const PoseError& error) { return !MissOf(error.off).any(); }

/// What one answer is worth.
struct Judgement {
  /// By the paper (Sec. "Correctness Criteria"): right if the *place* of the best candidate lies
  /// within the limit of the query's true position; what the answer says of the pose changes
  /// nothing.
  ScoredQuery scored;
  /// Rank from 1 of the first candidate whose place lies within the limit; 0: none does.
  int first_right = 0;
  /// Of the best candidate's pose; none without a candidate or a true pose.
  std::optional<PoseError> error;
  /// That pose is right: what a confidence speaks of.
  bool is_pose_right = false;
  /// It is, though the query is no revisit: no place lies within the limit. Wrong as a match.
  bool is_right_beyond = false;
};

/// Judges the candidates of one answer, best first. The score is the best one's confidence, where
/// it tells one, else one less its distance. Pure.
[[nodiscard]] Judgement Judge(const QueryTruth& truth, std::span<const Candidate> candidates,
                              double within_m);

/// Answers counted by their outcome, and by whether they are right.
struct OutcomeCounts {
  std::size_t num_queries = 0;
  std::size_t num_localized = 0;
  std::size_t num_ambiguous = 0;
  std::size_t num_not_recognized = 0;
  std::size_t num_insufficient = 0;

  /// Whose best candidate's pose is right, whatever the outcome.
  std::size_t num_pose_right = 0;
  std::size_t num_localized_right = 0;
  /// Localized and not right: told as sure, and wrong.
  std::size_t num_false = 0;
  /// Of the false: what was missed; one answer may miss several. A query that was taken elsewhere
  /// misses none of them.
  std::size_t num_false_plane = 0;
  std::size_t num_false_height = 0;
  std::size_t num_false_heading = 0;

  void Add(const Answer& answer) { AddOutcome(answer.outcome); }
  /// With what is true: a query without a true pose was taken elsewhere, so nothing is right there.
  void Add(const Answer& answer, const Judgement& judgement);

 private:
  void AddOutcome(Outcome outcome);
};

/// The limits that a difference exceeds, as "plane", "height" and "heading" with + between; empty
/// where none.
[[nodiscard]] std::string MissText(const PoseMiss& miss);

}  // namespace scanloc::eval
