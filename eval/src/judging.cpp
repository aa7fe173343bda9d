#include "scanloc/eval/judging.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "scanloc/eval/ground_truth.hpp"

namespace scanloc::eval {
namespace {

int FirstRight(const Pose& T_map_true, std::span<const Candidate> candidates, double within_m) {
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (PlanarDistance_m(candidates[i].T_map_place, T_map_true) <= within_m) {
      return static_cast<int>(i) + 1;
    }
  }
  return 0;
}

}  // namespace

PoseError ErrorOf(const Pose& T_map_found, const Pose& T_map_true) {
  const double yaw_rad = Yaw(T_map_true);
  const Eigen::Vector2d off_m = (T_map_found.translation() - T_map_true.translation()).head<2>();
  const Eigen::Vector2d left(-std::sin(yaw_rad), std::cos(yaw_rad));
  return {DifferenceOf(T_map_found, T_map_true), std::abs(left.dot(off_m))};
}

Judgement Judge(const QueryTruth& truth, std::span<const Candidate> candidates, double within_m) {
  Judgement judgement;
  ScoredQuery& scored = judgement.scored;
  scored.is_revisit = IsRevisit(truth.nearest, within_m);
  if (candidates.empty()) return judgement;
  const Candidate& best = candidates.front();
  scored.has_match = true;
  scored.score = best.confidence.value_or(1.0 - best.distance);
  if (!truth.T_map_query) return judgement;
  judgement.first_right = FirstRight(*truth.T_map_query, candidates, within_m);
  scored.is_right = scored.is_revisit && judgement.first_right == 1;
  judgement.error = ErrorOf(best.T_map_query, *truth.T_map_query);
  judgement.is_pose_right = IsRight(*judgement.error);
  judgement.is_right_beyond = judgement.is_pose_right && !scored.is_revisit;
  return judgement;
}

void OutcomeCounts::AddOutcome(Outcome outcome) {
  ++num_queries;
  switch (outcome) {
    case Outcome::kLocalized:
      ++num_localized;
      break;
    case Outcome::kAmbiguous:
      ++num_ambiguous;
      break;
    case Outcome::kNotRecognized:
      ++num_not_recognized;
      break;
    case Outcome::kInsufficientScan:
      ++num_insufficient;
      break;
  }
}

void OutcomeCounts::Add(const Answer& answer, const Judgement& judgement) {
  AddOutcome(answer.outcome);
  num_pose_right += judgement.is_pose_right ? 1 : 0;
  if (answer.outcome != Outcome::kLocalized) return;
  ++(judgement.is_pose_right ? num_localized_right : num_false);
  if (!judgement.error) return;
  const PoseMiss miss = MissOf(judgement.error->off);
  num_false_plane += miss.plane ? 1 : 0;
  num_false_height += miss.height ? 1 : 0;
  num_false_heading += miss.heading ? 1 : 0;
}

std::string MissText(const PoseMiss& miss) {
  std::string text;
  const auto add = [&](bool missed, const char* name) {
    if (missed) text += text.empty() ? name : std::string("+") + name;
  };
  add(miss.plane, "plane");
  add(miss.height, "height");
  add(miss.heading, "heading");
  return text;
}

}  // namespace scanloc::eval
