#include "structural/signature_index.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

namespace scanloc {
namespace {

constexpr std::size_t kNumLanes = SignatureRows::kNumLanes;
constexpr std::uint32_t kAllLanes = (1U << kNumLanes) - 1U;
/// Places in a run; some runs are a batch of places.
constexpr std::size_t kRunLength = 8;
constexpr std::size_t kRunsPerBatch = kNumLanes / kRunLength;
/// Batches of places whose runs are a batch.
constexpr std::size_t kBatchesAtOnce = kNumLanes / kRunsPerBatch;
/// Of so many places the halves are looked at by two threads: a millisecond of work.
constexpr std::size_t kLeastForTwo = 4 * SignatureIndex::kMaxExact;

constexpr double kScaleOfQuery = 127.0;
/// What the cart key says against the others, each of unit length.
constexpr double kWeightOfCart = 0.5;

/// No place: less than any score.
constexpr std::int16_t kNoScore = std::numeric_limits<std::int16_t>::min();

using BothCompared = std::array<SignaturesCompared, 2>;

/// How many scores are so high or higher, but for the last digits.
class ScoreCounts {
 public:
  void Add(std::int16_t score) { ++counts_[static_cast<std::size_t>(score - kNoScore) / kWidth]; }

  /// A score that at least k have, if there are as many, and hardly more than k.
  [[nodiscard]] std::int16_t LeastOfBest(std::size_t k) const {
    std::size_t num_better = 0;
    std::size_t bin = counts_.size();
    while (bin > 0 && num_better < k) num_better += counts_[--bin];
    return static_cast<std::int16_t>(
        std::max(static_cast<int>(bin * kWidth) + kNoScore, kNoScore + 1));
  }

 private:
  static constexpr std::size_t kWidth = 64;
  std::array<std::uint32_t, (1 << 16) / kWidth> counts_{};
};

/// A place, and what it has of the query.
struct Scored {
  std::int16_t score = 0;
  std::int16_t spot = 0;
  std::uint32_t place = 0;
};

/// The best k, that first; of equals in the order given.
std::vector<Scored> BestOf(const BothCompared& both, std::size_t k) {
  ScoreCounts counts;
  for (const SignaturesCompared& half : both) {
    for (const SignatureScores& batch : half.batches) {
      for (const std::int16_t score : batch.score) counts.Add(score);
    }
  }
  const std::int16_t least = counts.LeastOfBest(k);
  std::vector<Scored> scored;
  std::int16_t highest = least;
  for (const SignaturesCompared& half : both) {
    for (std::size_t i = 0; i < half.batches.size(); ++i) {
      const SignatureScores& batch = half.batches[i];
      int num_good = 0;  // mostly none: counted without a branch
      for (const std::int16_t score : batch.score) num_good += score >= least ? 1 : 0;
      if (num_good == 0) continue;
      for (std::uint32_t lane = 0; lane < kNumLanes; ++lane) {
        if (batch.score[lane] < least) continue;
        scored.push_back({batch.score[lane], batch.row[lane], half.first_places[i] + lane});
        highest = std::max(highest, batch.score[lane]);
      }
    }
  }
  // Where those of each score go, the highest score first.
  std::vector<std::uint32_t> next(static_cast<std::size_t>(highest - least) + 2);
  const auto bin_of = [&](const Scored& s) { return static_cast<std::size_t>(highest - s.score); };
  for (const Scored& s : scored) ++next[bin_of(s) + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<Scored> ordered(std::min(k, scored.size()));
  for (const Scored& s : scored) {
    const std::size_t at = next[bin_of(s)]++;
    if (at < ordered.size()) ordered[at] = s;
  }
  return ordered;
}

/// The best but n of both.
std::int16_t NthBest(std::size_t n, const std::array<std::vector<std::int16_t>, 2>& both) {
  ScoreCounts counts;
  for (const std::vector<std::int16_t>& scores : both) {
    for (const std::int16_t score : scores) counts.Add(score);
  }
  const std::int16_t least = counts.LeastOfBest(n + 1);
  std::vector<std::int16_t> best;
  for (const std::vector<std::int16_t>& scores : both) {
    std::copy_if(scores.begin(), scores.end(), std::back_inserter(best),
                 [&](std::int16_t score) { return score >= least; });
  }
  const auto nth = best.begin() + static_cast<std::ptrdiff_t>(n);
  std::nth_element(best.begin(), nth, best.end(), std::greater<>());
  return *nth;
}

/// How many places are worth comparing of so many.
std::size_t NumToCompare(std::size_t num_places) {
  const double growth = static_cast<double>(num_places) / SignatureIndex::kMaxExact;
  return static_cast<std::size_t>(SignatureIndex::kMaxExact * std::cbrt(growth));
}

/// Those of some places one behind the other that are not excluded, a bit each.
std::uint32_t LanesOf(std::size_t first_place, std::size_t num_places,
                      const std::vector<bool>* excluded) {
  std::uint32_t lanes = (1U << num_places) - 1U;
  if (excluded == nullptr) return lanes;
  for (std::size_t lane = 0; lane < num_places; ++lane) {
    if ((*excluded)[first_place + lane]) lanes &= ~(1U << lane);
  }
  return lanes;
}

std::span<std::int8_t> In(std::vector<std::int8_t>& signature, const SignatureShape::Part& part) {
  return std::span(signature).subspan(part.begin, part.size);
}

}  // namespace

std::size_t NumToFind(const ShortlistParams& params, std::size_t num_places) {
  constexpr double kUsual = 20'000;
  const auto size = static_cast<double>(num_places);
  const double most =
      params.max_found * std::sqrt(std::sqrt(std::sqrt(std::max(1.0, size / kUsual))));
  return static_cast<std::size_t>(
      std::max(2.0 * params.num_places, std::min(params.found_share * size, most)));
}

std::vector<BearingGrid> SpotsOf(std::span<const Post> posts, const ShortlistParams& params) {
  std::vector<BearingGrid> spots;
  for (int i = -params.num_asides; i <= params.num_asides; ++i) {
    spots.emplace_back(posts, params.bearing_ring_m, i * params.aside_m);
  }
  return spots;
}

SignatureIndex::SignatureIndex(const Map& map, const SignatureIndex* before)
    : map_(map),
      shape_(map.params.polar.enabled ? map.params.polar.num_rings : 0,
             map.params.cart.enabled ? map.params.cart.num_rows : 0) {
  Extend(before);
}

void SignatureIndex::ReadKey(const ContextTable& table, std::size_t place, std::size_t& next_entry,
                             std::vector<std::int32_t>& retrieval_cm) {
  retrieval_cm.assign(static_cast<std::size_t>(table.num_rows()), 0);
  for (; next_entry < table.size(); ++next_entry) {
    const ContextTable::Entry entry = table.entry(next_entry);
    if (entry.place > static_cast<std::int32_t>(place)) return;
    if (!entry.augmented) table.ReadRetrievalKey(next_entry, retrieval_cm);
  }
}

void SignatureIndex::Extend(const SignatureIndex* before) {
  std::vector<std::int8_t> signature(shape_.size());
  std::vector<std::int32_t> retrieval_cm;
  const auto write_key = [&](const ContextTable& table, std::size_t place, std::size_t& next_entry,
                             const SignatureShape::Part& part) {
    if (part.size == 0) return;
    ReadKey(table, place, next_entry, retrieval_cm);
    WriteKey(retrieval_cm, SignatureRows::kScale, In(signature, part));
  };
  for (std::size_t place = blocks_.size(); place < map_.bearings.size(); ++place) {
    WriteBearings(map_.bearings[place], SignatureRows::kScale, In(signature, shape_.bearings()));
    write_key(map_.polar, place, next_polar_, shape_.polar());
    write_key(map_.cart, place, next_cart_, shape_.cart());
    Append(signature);
    if (before != nullptr) blocks_.ShareWith(before->blocks_);
  }
}

void SignatureIndex::Append(std::span<const std::int8_t> signature) {
  Block& block = blocks_.last();
  const std::size_t run = block.num_places / kRunLength;
  const std::size_t in_run = block.num_places % kRunLength;
  block.places.Set(block.num_places++, signature);
  if (in_run == 0) {
    block.sum.assign(signature.begin(), signature.end());
    block.runs.Set(run, signature);
  } else {
    for (std::size_t i = 0; i < signature.size(); ++i) block.sum[i] += signature[i];
  }
  if (in_run + 1 == kRunLength) {
    std::vector<std::int8_t> common(signature.size());
    for (const SignatureShape::Part& part : {shape_.bearings(), shape_.polar(), shape_.cart()}) {
      WriteScaled(std::span(block.sum).subspan(part.begin, part.size), SignatureRows::kScale,
                  In(common, part));
    }
    block.runs.Set(run, common);
  }
  blocks_.Appended(BlockHash(signature));
}

SignatureQuery SignatureIndex::QueryOf(std::span<const BearingGrid> spots, const Context& polar,
                                       const Context& cart) const {
  SignatureQuery query;
  std::vector<std::int8_t> row;
  for (const BearingGrid& spot : spots) {
    row.resize(shape_.bearings().size);
    WriteBearings(spot.Widened(), kScaleOfQuery, row);
    query.Add(shape_.bearings(), row);
  }
  const auto add_key = [&](std::span<const std::int32_t> retrieval_cm, double scale,
                           const SignatureShape::Part& part) {
    row.resize(part.size);
    WriteKey(retrieval_cm, scale, row);
    query.Add(part, row);
  };
  if (shape_.polar().size > 0 && !polar.empty()) {
    add_key(MakeKeys(polar).retrieval_cm, kScaleOfQuery, shape_.polar());
  }
  if (shape_.cart().size > 0 && !cart.empty()) {
    std::vector<std::int32_t> retrieval_cm = MakeKeys(cart).retrieval_cm;
    add_key(retrieval_cm, kWeightOfCart * kScaleOfQuery, shape_.cart());
    // As the reversed vehicle sees it.
    std::ranges::reverse(retrieval_cm);
    add_key(retrieval_cm, kWeightOfCart * kScaleOfQuery, shape_.cart());
  }
  return query;
}

std::array<std::vector<SignatureIndex::Part>, 2> SignatureIndex::Halves() const {
  std::array<std::vector<Part>, 2> halves;
  const std::size_t middle = blocks_.size() < kLeastForTwo ? blocks_.size() : blocks_.size() / 2;
  std::size_t first_place = 0;
  const auto add = [&](const Block& block) {
    const std::size_t num_batches = block.places.num_batches();
    const std::size_t num_before = middle - std::min(middle, first_place);
    const std::size_t cut = num_before >= block.num_places
                                ? num_batches
                                : num_before / (kBatchesAtOnce * kNumLanes) * kBatchesAtOnce;
    if (cut > 0) halves[0].push_back({&block, first_place, 0, cut});
    if (cut < num_batches) halves[1].push_back({&block, first_place, cut, num_batches});
    first_place += block.num_places;
  };
  for (const auto& block : blocks_.full()) add(*block);
  add(blocks_.last());
  return halves;
}

std::vector<std::int16_t> SignatureIndex::BestRuns(std::span<const Part> parts,
                                                   const SignatureQuery& query) {
  std::vector<std::int16_t> best;
  SignatureScores scores;
  for (const Part& part : parts) {
    for (std::size_t batch = part.begin; batch < part.end; ++batch) {
      const std::size_t in_batch = batch % kBatchesAtOnce;
      if (in_batch == 0) part.block->runs.Compare(batch / kBatchesAtOnce, query, scores);
      // Beyond the last run there is none, and nothing of the query.
      const auto* const first = &scores.score[in_batch * kRunsPerBatch];
      const std::size_t num_runs =
          std::min(kRunsPerBatch,
                   (part.block->num_places - batch * kNumLanes + kRunLength - 1) / kRunLength);
      best.push_back(*std::max_element(first, first + num_runs));
    }
  }
  return best;
}

SignaturesCompared SignatureIndex::CompareAll(std::span<const Part> parts,
                                              const SignatureQuery& query,
                                              std::span<const std::int16_t> best_runs,
                                              std::int16_t least_run,
                                              const std::vector<bool>* excluded) {
  SignaturesCompared compared;
  auto best_run = best_runs.begin();  // of a batch
  std::vector<std::size_t> batches;
  for (const Part& part : parts) {
    batches.clear();
    for (std::size_t batch = part.begin; batch < part.end; ++batch) {
      if (best_runs.empty() || *best_run++ >= least_run) batches.push_back(batch);
    }
    compared.batches.reserve(compared.batches.size() + batches.size());
    compared.first_places.reserve(compared.batches.size() + batches.size());
    const Block& block = *part.block;
    for (std::size_t i = 0; i < batches.size(); ++i) {
      // One behind the other the processor fetches them by itself.
      if (i + 1 < batches.size() && batches[i + 1] != batches[i] + 1) {
        block.places.Prefetch(batches[i + 1]);
      }
      const std::size_t first = batches[i] * kNumLanes;
      const std::uint32_t lanes = LanesOf(part.first_place + first,
                                          std::min(kNumLanes, block.num_places - first), excluded);
      if (lanes == 0) continue;
      compared.first_places.push_back(static_cast<std::uint32_t>(part.first_place + first));
      SignatureScores& scores = compared.batches.emplace_back();
      block.places.Compare(batches[i], query, scores);
      for (std::uint32_t none = ~lanes & kAllLanes; none != 0; none &= none - 1) {
        scores.score[static_cast<std::size_t>(std::countr_zero(none))] = kNoScore;
      }
    }
  }
  return compared;
}

std::vector<SignatureIndex::Found> SignatureIndex::MostAlike(const SignatureQuery& query,
                                                             std::size_t k,
                                                             const SearchControl& control) const {
  if (k == 0) return {};
  const std::array<std::vector<Part>, 2> halves = Halves();
  const auto for_both = [&](const auto& work) {
    if (halves[1].empty()) return work(0);
    control.RunBoth([&] { work(0); }, [&] { work(1); });
  };
  std::array<std::vector<std::int16_t>, 2> best_runs;
  std::int16_t least_run = 0;
  if (control.excluded == nullptr && blocks_.size() > kMaxExact) {
    for_both([&](std::size_t i) { best_runs[i] = BestRuns(halves[i], query); });
    least_run = NthBest(NumToCompare(blocks_.size()) / kNumLanes, best_runs);
  }
  BothCompared compared;
  for_both([&](std::size_t i) {
    compared[i] = CompareAll(halves[i], query, best_runs[i], least_run, control.excluded);
  });
  std::vector<Found> found;
  for (const Scored& best : BestOf(compared, k)) {
    found.push_back({static_cast<std::int32_t>(best.place), static_cast<std::size_t>(best.spot)});
  }
  return found;
}

}  // namespace scanloc
