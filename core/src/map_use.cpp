#include "scanloc/core/map_use.hpp"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"

namespace scanloc {
namespace {

constexpr double kNumRecent = 8.0;

absl::Status CheckUseCount(const char* name, std::int64_t count) {
  if (count >= 0) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(name, " is ", count, "; it is never negative"));
}

void MoveMean(double value, double num, double& mean) { mean += (value - mean) / num; }

void CountFound(const Candidate& candidate, std::int64_t now_ns, PlaceUse& use) {
  const auto num = static_cast<double>(++use.num_found);
  MoveMean(candidate.confidence.value_or(0.0), num, use.confidence);
  MoveMean(candidate.distance, num, use.disagreement);
  MoveMean(candidate.distance, std::min(num, kNumRecent), use.recent_disagreement);
  use.last_found_ns = now_ns;
}

}  // namespace

absl::Status Validate(const PlaceUse& use) {
  for (const auto& [name, count] : {std::pair{"num_found", use.num_found},
                                    {"num_refused", use.num_refused},
                                    {"last_found_ns", use.last_found_ns},
                                    {"last_refused_ns", use.last_refused_ns}}) {
    if (auto status = CheckUseCount(name, count); !status.ok()) return status;
  }
  for (const auto& [name, share] : {std::pair{"confidence", use.confidence},
                                    {"disagreement", use.disagreement},
                                    {"recent_disagreement", use.recent_disagreement}}) {
    if (share >= 0.0 && share <= 1.0) continue;
    return absl::InvalidArgumentError(absl::StrCat(name, " is ", share, "; it must lie in [0, 1]"));
  }
  return absl::OkStatus();
}

absl::Status Validate(const MapUse& use) {
  for (const auto& [name, count] : {std::pair{"since_ns", use.since_ns},
                                    {"until_ns", use.until_ns},
                                    {"num_localized", use.num_localized},
                                    {"num_ambiguous", use.num_ambiguous},
                                    {"num_not_recognized", use.num_not_recognized},
                                    {"num_insufficient", use.num_insufficient},
                                    {"num_refused_nowhere", use.num_refused_nowhere}}) {
    if (auto status = CheckUseCount(name, count); !status.ok()) return status;
  }
  for (const auto& [place, of_place] : use.places) {
    if (auto status = CheckUseCount("place", place); !status.ok()) return status;
    if (auto status = Validate(of_place); !status.ok()) return status;
  }
  return absl::OkStatus();
}

MapUse TotalsOf(const MapUse& use) {
  return {.content_id = use.content_id,
          .since_ns = use.since_ns,
          .until_ns = use.until_ns,
          .num_localized = use.num_localized,
          .num_ambiguous = use.num_ambiguous,
          .num_not_recognized = use.num_not_recognized,
          .num_insufficient = use.num_insufficient,
          .num_refused_nowhere = use.num_refused_nowhere,
          .places = {}};
}

void Count(const Answer& answer, std::optional<std::int32_t> last_found, std::int64_t now_ns,
           MapUse& use) {
  if (use.since_ns == 0) use.since_ns = now_ns;
  use.until_ns = now_ns;
  if (answer.outcome == Outcome::kInsufficientScan) {
    ++use.num_insufficient;
    return;
  }
  const bool has_candidate = !answer.candidates.empty();
  if (answer.outcome == Outcome::kLocalized && has_candidate) {
    ++use.num_localized;
    const Candidate& best = answer.candidates.front();
    return CountFound(best, now_ns, use.places[best.place]);
  }
  ++(answer.outcome == Outcome::kAmbiguous ? use.num_ambiguous : use.num_not_recognized);
  const std::optional<std::int32_t> place =
      has_candidate ? std::optional(answer.candidates.front().place) : last_found;
  if (!place) {
    ++use.num_refused_nowhere;
    return;
  }
  PlaceUse& refused = use.places[*place];
  ++refused.num_refused;
  refused.last_refused_ns = now_ns;
}

double TroubleOf(const PlaceUse& use) {
  const std::int64_t num = use.num_found + use.num_refused;
  const double refused =
      num == 0 ? 0.0 : static_cast<double>(use.num_refused) / static_cast<double>(num);
  return std::max(refused, use.recent_disagreement);
}

}  // namespace scanloc
