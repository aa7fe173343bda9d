#include "structural/locate.hpp"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"

namespace scanloc {
namespace {

void Decide(const Map& map, const Evidence& evidence, double min_confidence, Answer& answer) {
  const double confidence = *answer.candidates.front().confidence;
  const double unrivalled =
      Confidence(map.calibration, {evidence.score, std::min(evidence.rival, kUnrelatedScore)});
  if (confidence >= min_confidence) {
    answer.outcome = Outcome::kLocalized;
    answer.reason =
        absl::StrFormat("%.0f %% of the upright structure agrees; the best other spot has %.0f %%",
                        100.0 * evidence.score, 100.0 * evidence.rival);
  } else if (unrivalled >= min_confidence) {
    answer.outcome = Outcome::kAmbiguous;
    answer.reason = absl::StrFormat(
        "two distinct spots explain the scan: %.0f %% and %.0f %% of the upright structure agree",
        100.0 * evidence.score, 100.0 * evidence.rival);
  } else {
    answer.outcome = Outcome::kNotRecognized;
    answer.reason = absl::StrFormat(
        "only %.0f %% of the upright structure agrees with the best spot (%.0f %% with the next): "
        "out of the map, or changed too much",
        100.0 * evidence.score, 100.0 * evidence.rival);
  }
}

}  // namespace

Answer LocateByStructure(const Map& map, const AutoSearch& search, const ScanDescriptor& scan,
                         const Query& query, const SearchControl& control) {
  Answer answer;
  if (scan.structure.posts.size() < kMinPosts) {
    answer.outcome = Outcome::kInsufficientScan;
    answer.reason = absl::StrFormat("the scan shows %d pieces of upright structure; %d are needed",
                                    scan.structure.posts.size(), kMinPosts);
    return answer;
  }

  const std::vector<Hypothesis> verified =
      search.Find(scan, {.shortlist = query.num_candidates.value_or(AutoSearch::kShortlist)},
                  control, answer.times);
  if (verified.empty()) {
    answer.outcome = Outcome::kNotRecognized;
    answer.reason = "the map has no place to compare with";
    return answer;
  }

  const Evidence evidence = Weigh(search, scan.structure, verified);
  for (const Hypothesis& hypothesis : verified) {
    if (static_cast<int>(answer.candidates.size()) >= query.max_answers) break;
    const Pose T_map_query = search.PoseInMap(scan.structure, hypothesis);
    const bool is_told =
        std::any_of(answer.candidates.begin(), answer.candidates.end(), [&](const Candidate& c) {
          return (c.T_map_query.translation() - T_map_query.translation()).norm() <
                 VerifyOptions{}.rival_radius_m;
        });
    if (is_told) continue;
    const bool is_best = answer.candidates.empty();
    const double confidence = Confidence(
        map.calibration, is_best ? evidence : Evidence{hypothesis.score, verified.front().score});
    auto candidate = search.CandidateAt(T_map_query, hypothesis.score, confidence, control);
    if (candidate) answer.candidates.push_back(*std::move(candidate));
  }
  Decide(map, evidence, query.min_confidence.value_or(map.params.search.min_confidence), answer);
  return answer;
}

}  // namespace scanloc
