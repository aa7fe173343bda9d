#include "scan_context/locate.hpp"

#include <algorithm>
#include <cstdint>
#include <numbers>
#include <utility>

#include "absl/strings/str_format.h"

// The paper's three-stage place recognition (Sec. V), read from ContextSearch::Locate downwards.

namespace scanloc {
namespace {

/// Comparisons between two looks whether anybody still waits for the answer.
constexpr std::size_t kLookInterval = 64;

/// Eq. LoopFound: the best candidate is recognised if its distance is below the threshold.
void DecideByDistance(double threshold, Answer& answer) {
  if (answer.candidates.empty()) {
    answer.outcome = Outcome::kNotRecognized;
    answer.reason = "the map has no place to compare with";
    return;
  }
  const double distance = answer.candidates.front().distance;
  const bool recognized = distance < threshold;
  answer.outcome = recognized ? Outcome::kLocalized : Outcome::kNotRecognized;
  answer.reason = absl::StrFormat("best distance %.3f is %s the threshold %.3f", distance,
                                  recognized ? "below" : "not below", threshold);
}

}  // namespace

ContextSearch::ContextSearch(const Map& map, DescriptorKind kind, const ContextSearch* before)
    : map_(map),
      kind_(kind),
      table_(kind == DescriptorKind::kPolar ? map.polar : map.cart),
      index_(table_, before == nullptr ? nullptr : &before->index_) {}

absl::StatusOr<Answer> ContextSearch::Locate(const ScanDescriptor& scan, const Query& query,
                                             const SearchControl& control) const {
  const SearchParams& params = map_.params.search;
  const Method method = MethodOf(query, map_.params);
  const bool is_polar = kind_ == DescriptorKind::kPolar;
  const Context& context = is_polar ? scan.polar : scan.cart;
  const Keys keys = MakeKeys(context);

  Answer answer;
  const std::int64_t start_ns = control.Now_ns();
  const std::vector<std::size_t> retrieved = Retrieve(keys, query, method, control);
  const std::int64_t retrieved_ns = control.Now_ns();
  const absl::StatusOr<std::vector<Scored>> compared =
      Compare({context.num_rows, context.num_cols, context.cells_cm, keys.aligning_cm}, retrieved,
              method, control);
  if (!compared.ok()) return compared.status();
  const std::vector<Scored>& scored = *compared;
  answer.times.retrieve_ns = retrieved_ns - start_ns;
  answer.times.match_ns = control.Now_ns() - retrieved_ns;

  const std::size_t num_answers =
      std::min(scored.size(), static_cast<std::size_t>(query.max_answers));
  for (std::size_t i = 0; i < num_answers; ++i) {
    answer.candidates.push_back(CandidateFrom(scored[i], scan.structure));
  }
  DecideByDistance(
      query.threshold.value_or(is_polar ? params.polar_threshold : params.cart_threshold), answer);
  return answer;
}

/// Stage 1, place retrieval using the retrieval key (Sec. V-A). Brute force takes every entry.
std::vector<std::size_t> ContextSearch::Retrieve(const Keys& keys, const Query& query,
                                                 const Method& method,
                                                 const SearchControl& control) const {
  std::vector<std::size_t> entries;
  if (method.brute_force) {
    for (std::size_t i = 0; i < table_.size(); ++i) {
      if (control.Excludes(PlaceOf(i))) continue;
      if (method.augmented || !table_.entry(i).augmented) entries.push_back(i);
    }
    return entries;
  }
  const int k = query.num_candidates.value_or(map_.params.search.num_candidates);
  for (const KeyIndex::Neighbor& neighbor :
       index_.Search(keys.retrieval_cm, k, method.augmented, control.excluded)) {
    entries.push_back(neighbor.entry);
  }
  return entries;
}

/// Stages 2 and 3, pre-alignment by the aligning key (Sec. V-B) and comparison of the full
/// descriptors (Sec. V-C). Best first; equal distances: the lower place.
absl::StatusOr<std::vector<ContextSearch::Scored>> ContextSearch::Compare(
    const ContextView& query, const std::vector<std::size_t>& entries, const Method& method,
    const SearchControl& control) const {
  const AlignOptions align = AlignOptionsOf(map_.params, kind_);
  SearchControl untimed = control;  // every candidate is compared
  untimed.deadline_ns = 0;
  PayloadView payload(map_, untimed);
  std::vector<Scored> scored;
  scored.reserve(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (i % kLookInterval == 0) {
      if (control.IsUnwanted()) break;
      payload.Forget();
      for (std::size_t j = i; j < std::min(i + kLookInterval, entries.size()); ++j) {
        payload.WillUse(kind_, entries[j]);
      }
      payload.Fetch();
    }
    const std::size_t entry = entries[i];
    const ContextView place = payload.Context(kind_, entry);
    if (!payload.status().ok()) return payload.status();
    const Match match = method.naive_alignment ? AlignNaively(query, place, align)
                                               : AlignByKey(query, place, align);
    // Entries of a place follow each other; of each place only the best is kept.
    if (!scored.empty() && PlaceOf(scored.back().entry) == PlaceOf(entry)) {
      if (match.distance < scored.back().match.distance) scored.back() = {entry, match};
    } else {
      scored.push_back({entry, match});
    }
  }
  std::sort(scored.begin(), scored.end(), [](const Scored& a, const Scored& b) {
    return std::pair(a.match.distance, a.entry) < std::pair(b.match.distance, b.entry);
  });
  return scored;
}

/// The relative pose that a match says. A polar column is a turn, and the variant's root shift the
/// lateral displacement; a cart column is a lateral displacement, and the double flip a reversed
/// vehicle, whose left is the place's right.
Candidate ContextSearch::CandidateFrom(const Scored& scored, const Structure& query) const {
  Candidate candidate = CandidateOf(map_, PlaceOf(scored.entry));
  candidate.distance = scored.match.distance;
  const auto& variant = table_.entry(scored.entry);
  const int num_cols = table_.num_cols();
  if (kind_ == DescriptorKind::kPolar) {
    candidate.yaw_rad = WrapAngle(scored.match.shift * (2.0 * std::numbers::pi / num_cols));
    candidate.lateral_m = variant.root_shift_m;
  } else {
    // Only a circular shift comes from either side; a bounded one has its own sign.
    const bool is_from_right =
        map_.params.cart.shift_mode == ShiftMode::kCircular && scored.match.shift >= num_cols / 2;
    const int shift = is_from_right ? scored.match.shift - num_cols : scored.match.shift;
    const double lateral_m = shift * (2.0 * map_.params.cart.max_y_m / num_cols);
    candidate.yaw_rad = variant.flipped ? std::numbers::pi : 0.0;
    candidate.lateral_m = variant.flipped ? -lateral_m : lateral_m;
  }
  // Contexts of sensors that are not mounted upright are those of their levelled frames.
  Pose T_map_context = candidate.T_map_place;
  if (!map_.grounds.empty()) {
    const Ground& place = map_.grounds[PlaceOf(scored.entry)].ground;
    T_map_context = T_map_context * ContextFromSensor(place).inverse();
  }
  candidate.T_map_query = T_map_context * PlanarOffset(candidate.lateral_m, candidate.yaw_rad) *
                          ContextFromSensor(query);
  return candidate;
}

}  // namespace scanloc
