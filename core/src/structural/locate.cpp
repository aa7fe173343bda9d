#include "structural/locate.hpp"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"

namespace scanloc {
namespace {

constexpr const char* kUpUnknown =
    "the scan does not say which way is up: no plane has the sensor at its height above ground and "
    "nothing below, or several have; turn the scan upright by how its sensor is mounted";

void DecideByConfidence(const std::vector<Spot>& spots, double confidence, double min_confidence,
                        double cohort_share, const EvidenceParams& params, Answer& answer) {
  const Support& support = *spots.front().support;
  const double percent = 100.0 * spots.front().hypothesis.score;
  const double percent_from_above = 100.0 * support.score;
  const double rival_score = spots.size() < 2 ? 0.0 : spots[1].hypothesis.score;
  const double rival_percent = 100.0 * rival_score;
  if (confidence >= min_confidence) {
    answer.outcome = Outcome::kLocalized;
    answer.reason =
        absl::StrFormat("%.0f %% of the upright structure agrees; the best other spot has %.0f %%",
                        percent, rival_percent);
  } else if (!ExplainsLittle(spots.front().hypothesis.score, support, params) &&
             (Logistic(SupportLogOdds(support, params) + params.cohort * cohort_share) >=
                  min_confidence ||
              rival_score >= params.explaining_score)) {
    answer.outcome = Outcome::kAmbiguous;
    if (support.unseen > params.max_unseen) {
      answer.reason = absl::StrFormat(
          "%.0f %% of the upright structure agrees, but the place was mapped in %.0f %% of the "
          "directions only: what looks like it may stand where the map did not look",
          percent, 100.0 * (1.0 - support.unseen));
      return;
    }
    answer.reason = absl::StrFormat(
        "two distinct spots explain the scan: %.0f %% and %.0f %% of the upright structure agree, "
        "and %.0f %% with the mirror image of the first",
        percent, rival_percent, percent_from_above - 100.0 * support.over_mirror);
  } else {
    answer.outcome = Outcome::kNotRecognized;
    answer.reason = absl::StrFormat(
        "%.0f %% of the upright structure agrees with the best spot, of its mirror image %.0f %%, "
        "and %.0f %% a metre off: out of the map, changed too much, or nothing that tells it apart",
        percent_from_above, percent_from_above - 100.0 * support.over_mirror,
        percent_from_above - 100.0 * support.sharpness);
  }
}

}  // namespace

absl::StatusOr<Answer> LocateByStructure(const Map& map, const AutoSearch& search,
                                         const ScanDescriptor& scan, const Query& query,
                                         const SearchControl& control) {
  Answer answer;
  const AutoParams& params = map.params.automatic;
  if (!scan.knows_up) {
    answer.outcome = Outcome::kInsufficientScan;
    answer.reason = kUpUnknown;
    return answer;
  }
  if (!ShowsEnough(scan.structure.posts, params)) {
    answer.outcome = Outcome::kInsufficientScan;
    answer.reason = absl::StrFormat("the scan shows %d pieces of upright structure; %d are needed",
                                    CountDistinct(scan.structure.posts, params.posts.cell_m),
                                    params.evidence.min_posts);
    return answer;
  }

  const absl::StatusOr<std::vector<Spot>> found = search.Find(
      scan, {.shortlist = query.num_candidates.value_or(0), .num_measured = query.max_answers},
      control, answer.times);
  if (!found.ok()) return found.status();
  const std::vector<Spot>& spots = *found;
  if (spots.empty()) {
    answer.outcome = Outcome::kNotRecognized;
    answer.reason = "the map has no place to compare with";
    return answer;
  }
  for (const Spot& spot : spots) answer.spot_scores.push_back(spot.score);
  const std::vector<double> confidences = ConfidencesOf(spots, params.evidence, search.up());
  for (std::size_t i = 0; i < spots.size(); ++i) {
    if (static_cast<int>(answer.candidates.size()) >= query.max_answers) break;
    auto candidate = search.CandidateAt(spots[i].T_map_query, spots[i].covariance,
                                        spots[i].hypothesis.score, confidences[i], control);
    if (!candidate) continue;
    candidate->matched = spots[i].hypothesis.place;
    answer.candidates.push_back(*std::move(candidate));
  }
  DecideByConfidence(spots, confidences.front(),
                     query.min_confidence.value_or(map.params.search.min_confidence),
                     CohortShare(spots, params.evidence, search.up()), params.evidence, answer);
  return answer;
}

}  // namespace scanloc
