#include "scanloc/core/among_maps.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "absl/strings/str_format.h"
#include "structural/evidence.hpp"

namespace scanloc {
namespace {

/// How much the spots of a map weigh beside one that is told with such a score by another.
double WeightOf(const Answer& answer, double score, const MapAnswer& teller) {
  double sum = 0.0;
  for (const double other : answer.spot_scores) {
    sum +=
        std::exp(-RivalryLogOdds(score, other, teller.num_posts, teller.params.automatic.evidence));
  }
  return sum;
}

/// Of all spots of all maps, as the best one of this map sees them, the share that is its own
/// map's.
double ShareOf(const MapAnswer& own, const std::vector<MapAnswer>& all) {
  const double score = own.answer.spot_scores.front();
  double sum = 0.0;
  for (const MapAnswer& other : all) sum += WeightOf(other.answer, score, own);
  return WeightOf(own.answer, score, own) / sum;
}

/// Better ones first.
bool IsBetter(const Candidate& a, const Candidate& b) {
  if (a.confidence && b.confidence && *a.confidence != *b.confidence) {
    return *a.confidence > *b.confidence;
  }
  return a.distance < b.distance;
}

/// As ambiguous as it is beside another map.
void Doubt(MapAnswer& told, const MapAnswer& rival) {
  told.answer.outcome = Outcome::kAmbiguous;
  told.answer.reason = absl::StrFormat(
      "two maps explain the scan: %s at distance %.3f, and %s at %.3f; name the map if it is known",
      told.map, told.answer.candidates.front().distance, rival.map,
      rival.answer.candidates.front().distance);
}

}  // namespace

MapAnswer AmongMaps(std::vector<MapAnswer> answers, const Query& query) {
  std::vector<double> shares;
  for (const MapAnswer& own : answers) {
    shares.push_back(own.answer.spot_scores.empty() ? 1.0 : ShareOf(own, answers));
  }
  StageTimes times;
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    for (Candidate& candidate : answers[i].answer.candidates) {
      candidate.map = answers[i].map;
      if (candidate.confidence) *candidate.confidence *= shares[i];
      candidates.push_back(candidate);
    }
    times.describe_ns += answers[i].answer.times.describe_ns;
    times.retrieve_ns += answers[i].answer.times.retrieve_ns;
    times.match_ns += answers[i].answer.times.match_ns;
    times.verify_ns += answers[i].answer.times.verify_ns;
  }
  std::stable_sort(candidates.begin(), candidates.end(), IsBetter);
  // Maps in the order of their best candidates; those that have none say least.
  std::stable_sort(answers.begin(), answers.end(), [](const MapAnswer& a, const MapAnswer& b) {
    if (a.answer.candidates.empty() || b.answer.candidates.empty()) {
      return !a.answer.candidates.empty() && b.answer.candidates.empty();
    }
    return IsBetter(a.answer.candidates.front(), b.answer.candidates.front());
  });
  MapAnswer& told = answers.front();
  const std::optional<double> confidence =
      candidates.empty() ? std::nullopt : candidates.front().confidence;
  const bool is_sure =
      confidence && *confidence >= query.min_confidence.value_or(told.params.search.min_confidence);
  const auto rival =
      std::find_if(std::next(answers.begin()), answers.end(), [&](const MapAnswer& other) {
        return !other.answer.candidates.empty() &&
               (confidence || other.answer.outcome == Outcome::kLocalized);
      });
  if (told.answer.outcome == Outcome::kLocalized && !is_sure && rival != answers.end()) {
    Doubt(told, *rival);
  }
  candidates.resize(std::min(candidates.size(), static_cast<std::size_t>(query.max_answers)));
  told.answer.candidates = std::move(candidates);
  told.answer.times = times;
  return std::move(told);
}

}  // namespace scanloc
