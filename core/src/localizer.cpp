#include "scanloc/core/localizer.hpp"

#include <algorithm>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/scan_context/match.hpp"
#include "structural/auto_search.hpp"

// The paper's three-stage place recognition (Sec. V), read from Localizer::Localize downwards.

namespace scanloc {
namespace {

/// One retrieved place and how well the query lies on it.
struct Scored {
  std::size_t entry = 0;
  Match match;
};

/// What the stages share: one query against the contexts of one kind.
struct Search {
  const ContextTable& table;
  const KeyIndex& index;
  ContextView query;
  std::span<const std::int32_t> retrieval_cm;
  Method method;
  AlignOptions align;
  int num_candidates;
  const std::vector<bool>* excluded;
  const std::function<bool()>& is_unwanted;
};

/// Comparisons between two looks whether anybody still waits for the answer.
constexpr std::size_t kLookInterval = 64;

std::size_t PlaceOf(const Search& search, std::size_t entry) {
  return static_cast<std::size_t>(search.table.entry(entry).place);
}

/// Stage 1, place retrieval using the retrieval key (Sec. V-A). Brute force takes every entry.
std::vector<std::size_t> Retrieve(const Search& search) {
  std::vector<std::size_t> entries;
  if (search.method.brute_force) {
    for (std::size_t i = 0; i < search.table.size(); ++i) {
      if (search.excluded != nullptr && (*search.excluded)[PlaceOf(search, i)]) continue;
      if (search.method.augmented || !search.table.entry(i).augmented) entries.push_back(i);
    }
    return entries;
  }
  for (const KeyIndex::Neighbor& neighbor : search.index.Search(
           search.retrieval_cm, search.num_candidates, search.method.augmented, search.excluded)) {
    entries.push_back(neighbor.entry);
  }
  return entries;
}

/// Stages 2 and 3, pre-alignment by the aligning key (Sec. V-B) and comparison of the full
/// descriptors (Sec. V-C). Best first; equal distances: the lower place.
std::vector<Scored> Compare(const Search& search, const std::vector<std::size_t>& entries) {
  std::vector<Scored> scored;
  scored.reserve(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (i % kLookInterval == 0 && search.is_unwanted && search.is_unwanted()) break;
    const std::size_t entry = entries[i];
    const ContextView place = search.table.context(entry);
    const Match match = search.method.naive_alignment
                            ? AlignNaively(search.query, place, search.align)
                            : AlignByKey(search.query, place, search.align);
    // Entries of a place follow each other; of each place only the best is kept.
    if (!scored.empty() && PlaceOf(search, scored.back().entry) == PlaceOf(search, entry)) {
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

/// The relative pose that a polar match says: a column is a turn, the variant's root shift the
/// lateral displacement.
void FillPolarOffset(const ContextTable& table, const Scored& scored, Candidate& candidate) {
  const double sector_rad = 2.0 * std::numbers::pi / table.num_cols();
  candidate.yaw_rad = WrapAngle(scored.match.shift * sector_rad);
  candidate.lateral_m = table.entry(scored.entry).root_shift_m;
}

/// The relative pose that a cart match says: a column is a lateral displacement, and the double
/// flip a reversed vehicle, whose left is the place's right.
void FillCartOffset(const ContextTable& table, const CartParams& params, const Scored& scored,
                    Candidate& candidate) {
  const double col_m = 2.0 * params.max_y_m / params.num_cols;
  const int half = table.num_cols() / 2;
  const int shift =
      scored.match.shift >= half ? scored.match.shift - table.num_cols() : scored.match.shift;
  const bool flipped = table.entry(scored.entry).flipped;
  candidate.yaw_rad = flipped ? std::numbers::pi : 0.0;
  candidate.lateral_m = flipped ? -shift * col_m : shift * col_m;
}

absl::Status CheckShare(const char* name, const std::optional<double>& value) {
  if (!value || (*value >= 0.0 && *value <= 1.0)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrFormat("%s is %g; it must be in [0, 1]", name, *value));
}

absl::Status CheckOptions(const QueryOptions& options, const Method& method) {
  const int k = options.num_candidates.value_or(1);
  if (k < 1 || k > limits::kMaxCandidates) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "number of candidates is %d; it must be in [1, %d]", k, limits::kMaxCandidates));
  }
  if (options.max_answers < 1 || options.max_answers > limits::kMaxCandidates) {
    return absl::InvalidArgumentError(
        absl::StrFormat("number of answers is %d; it must be in [1, %d]", options.max_answers,
                        limits::kMaxCandidates));
  }
  if (absl::Status status = CheckShare("threshold", options.threshold); !status.ok()) return status;
  if (absl::Status status = CheckShare("min_confidence", options.min_confidence); !status.ok()) {
    return status;
  }
  if (options.budget_ns < 0) {
    return absl::InvalidArgumentError(
        absl::StrFormat("the budget is %d ns; it must not be negative", options.budget_ns));
  }
  if (method.automatic && options.threshold) {
    return absl::InvalidArgumentError(
        "a threshold is for the methods that compare descriptors; auto takes a least confidence");
  }
  if (!method.automatic && options.min_confidence) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "a least confidence is for the method auto; %s takes a threshold", MethodName(method)));
  }
  return absl::OkStatus();
}

/// Eq. LoopFound: the best candidate is recognised if its distance is below the threshold.
void Decide(double threshold, Answer& answer) {
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

Localizer::Localizer(std::shared_ptr<const Map> map) : map_(std::move(map)) {
  if (map_->params.polar.enabled) polar_index_.emplace(map_->polar);
  if (map_->params.cart.enabled) cart_index_.emplace(map_->cart);
  if (map_->params.structure.enabled) auto_search_ = std::make_shared<const AutoSearch>(*map_);
}

absl::StatusOr<std::shared_ptr<const Localizer>> Localizer::Create(std::shared_ptr<const Map> map) {
  if (absl::Status status = Validate(map->params); !status.ok()) return status;
  const std::size_t num_structures = map->params.structure.enabled ? map->places.size() : 0;
  if (map->structures.size() != num_structures) {
    return absl::InvalidArgumentError(
        absl::StrFormat("the map has %d structures; its parameters ask for %d",
                        map->structures.size(), num_structures));
  }
  return std::shared_ptr<const Localizer>(new Localizer(std::move(map)));
}

absl::Status Localizer::CheckQuery(const ScanDescriptor& query, const Method& method,
                                   const QueryOptions& options) const {
  if (absl::Status status = CheckOptions(options, method); !status.ok()) return status;
  if (absl::Status status = CheckServes(map_->params, method); !status.ok()) return status;
  if (options.excluded != nullptr && options.excluded->size() != map_->places.size()) {
    return absl::InvalidArgumentError(
        absl::StrFormat("excluded has %d elements; the map has %d places", options.excluded->size(),
                        map_->places.size()));
  }
  return Validate(query, map_->params);
}

absl::StatusOr<Answer> Localizer::Localize(const ScanDescriptor& query,
                                           const QueryOptions& options) const {
  const Params& params = map_->params;
  const Method method = options.method.value_or(DefaultMethod(params));
  if (absl::Status status = CheckQuery(query, method, options); !status.ok()) return status;

  Answer answer;
  answer.content_id = map_->content_id;
  if (query.num_voxels < static_cast<std::uint32_t>(params.search.min_voxels)) {
    answer.outcome = Outcome::kInsufficientScan;
    answer.reason = absl::StrFormat("the scan has %d occupied voxels in range; %d are needed",
                                    query.num_voxels, params.search.min_voxels);
    return answer;
  }
  answer = method.automatic ? LocalizeByStructure(query, options)
                            : LocalizeByContext(query, method, options);
  if (options.is_unwanted && options.is_unwanted()) {
    return absl::CancelledError("nobody waits for the answer any more");
  }
  return answer;
}

Answer Localizer::LocalizeByContext(const ScanDescriptor& query, const Method& method,
                                    const QueryOptions& options) const {
  const Params& params = map_->params;
  Answer answer;
  answer.content_id = map_->content_id;
  const bool is_polar = method.kind == DescriptorKind::kPolar;
  const Context& context = is_polar ? query.polar : query.cart;
  const Keys keys = MakeKeys(context);
  const Search search{
      .table = is_polar ? map_->polar : map_->cart,
      .index = is_polar ? *polar_index_ : *cart_index_,
      .query = {context.num_rows, context.num_cols, context.cells_cm, keys.aligning_cm},
      .retrieval_cm = keys.retrieval_cm,
      .method = method,
      .align = AlignOptionsOf(params, method.kind),
      .num_candidates = options.num_candidates.value_or(params.search.num_candidates),
      .excluded = options.excluded,
      .is_unwanted = options.is_unwanted};

  const auto now_ns = [&] { return options.now_ns == nullptr ? 0 : options.now_ns(); };
  const std::int64_t start_ns = now_ns();
  const std::vector<std::size_t> retrieved = Retrieve(search);
  const std::int64_t retrieved_ns = now_ns();
  const std::vector<Scored> scored = Compare(search, retrieved);
  answer.times.retrieve_ns = retrieved_ns - start_ns;
  answer.times.match_ns = now_ns() - retrieved_ns;

  const std::size_t num_answers =
      std::min(scored.size(), static_cast<std::size_t>(options.max_answers));
  for (std::size_t i = 0; i < num_answers; ++i) {
    Candidate candidate;
    candidate.place = search.table.entry(scored[i].entry).place;
    candidate.distance = scored[i].match.distance;
    if (is_polar) {
      FillPolarOffset(search.table, scored[i], candidate);
    } else {
      FillCartOffset(search.table, params.cart, scored[i], candidate);
    }
    const Place& place = map_->places[PlaceOf(search, scored[i].entry)];
    candidate.session = place.session;
    candidate.session_name = map_->sessions[static_cast<std::size_t>(place.session)];
    candidate.T_map_place = place.T_map_place;
    candidate.T_map_query =
        place.T_map_place * PlanarOffset(candidate.lateral_m, candidate.yaw_rad);
    answer.candidates.push_back(std::move(candidate));
  }
  Decide(options.threshold.value_or(is_polar ? params.search.polar_threshold
                                             : params.search.cart_threshold),
         answer);
  return answer;
}

}  // namespace scanloc
