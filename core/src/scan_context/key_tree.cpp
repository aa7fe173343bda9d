#include "scan_context/key_tree.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <compare>
#include <functional>

#include "scan/simd.hpp"

namespace scanloc {
namespace {

constexpr std::size_t kNumLanes = KeyBatches::kNumLanes;

/// What single precision may cost a distance, of the lengths of the keys.
constexpr float kRounding = 1e-6F;

/// So many candidates are looked at together at least.
constexpr std::size_t kLeastPatience = 16;

/// Keys that say where axes and ranges lie; more say no more.
constexpr std::size_t kMaxSample = 50'000;

std::vector<std::size_t> Sample(std::size_t begin, std::size_t end, std::size_t step) {
  std::vector<std::size_t> entries;
  const std::size_t stride = step * (1 + (end - begin) / step / kMaxSample);
  for (std::size_t i = begin; i < end; i += stride) entries.push_back(i);
  return entries;
}

std::vector<float> TurnedKeys(const ContextTable& table, const PrincipalAxes& axes,
                              std::size_t size, const std::vector<std::size_t>& entries) {
  std::vector<float> components(entries.size() * size);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    axes.Turn(table.retrieval_key_cm(entries[i]), std::span(components).subspan(i * size, size));
  }
  return components;
}

/// A squared distance, and what it is of.
struct Ranked {
  std::int32_t distance = 0;
  std::uint32_t what = 0;
  friend auto operator<=>(const Ranked&, const Ranked&) = default;  // NOLINT(modernize-use-nullptr)
};

constexpr std::size_t kNumBoxes = 16;

/// How far a key is from each of some boxes side by side, squared; bounds by component.
SCANLOC_SIMD void GapsOf(std::span<const std::int16_t> key, const std::int16_t* low,
                         const std::int16_t* high, std::int32_t* sums) {
  std::int32_t added[kNumBoxes] = {};
  for (const std::int32_t value : key) {
    for (std::size_t i = 0; i < kNumBoxes; ++i) {
      const std::int32_t gap = std::max(std::max(low[i] - value, value - high[i]), 0);
      added[i] += gap * gap;
    }
    low += kNumBoxes;
    high += kNumBoxes;
  }
  std::copy_n(added, kNumBoxes, sums);
}

}  // namespace

/// The quantized keys of a range of a table's entries, in its order.
struct KeyTree::Keys {
  std::size_t begin;
  std::size_t step;  // from entry to entry that is held
  std::size_t size;  // of one
  std::vector<std::int16_t> components;

  [[nodiscard]] const std::int16_t* Key(std::size_t entry) const {
    return components.data() + (entry - begin) / step * size;
  }
};

KeyTree::KeyTree(const ContextTable& table, KeyScale scale, std::size_t begin, std::size_t end)
    : num_held_(std::min(kNumHeld, static_cast<std::size_t>(table.num_rows()))),
      has_flips_(table.has_flips()),
      axes_(table, scale, Sample(begin, end, has_flips_ ? 2 : 1)) {
  const std::size_t step = has_flips_ ? 2 : 1;
  batches_ = KeyBatches(TurnedKeys(table, axes_, num_held_, Sample(begin, end, step)), num_held_);
  Keys keys{begin, step, batches_.key_size(), {}};
  std::vector<std::uint32_t> entries;
  entries.reserve((end - begin) / step);
  keys.components.reserve((end - begin) / step * keys.size);
  std::vector<std::int32_t> key_cm(static_cast<std::size_t>(table.num_rows()));
  std::vector<float> turned(num_held_);
  for (std::size_t i = begin; i < end; i += step) {
    table.ReadRetrievalKey(i, key_cm);
    greatest_norm_ = std::max(greatest_norm_, static_cast<float>(axes_.NormOf(key_cm)));
    axes_.Turn(key_cm, turned);
    const std::vector<std::int16_t> key = batches_.Quantize(turned.data()).components;
    keys.components.insert(keys.components.end(), key.begin(), key.end());
    entries.push_back(static_cast<std::uint32_t>(i));
  }
  Build(keys, entries, BoxOf(keys, entries));
}

KeyTree::Box KeyTree::BoxOf(const Keys& keys, std::span<const std::uint32_t> entries) {
  Box box;
  for (const std::uint32_t i : entries) {
    const std::int16_t* key = keys.Key(i);
    for (std::size_t c = 0; c < keys.size; ++c) {
      box[c].low = std::min<std::int32_t>(box[c].low, key[c]);
      box[c].high = std::max<std::int32_t>(box[c].high, key[c]);
    }
  }
  return box;
}

void KeyTree::Build(const Keys& keys, std::span<std::uint32_t> entries, const Box& box) {
  if (entries.size() <= kLeafSize) {
    AppendLeaf(keys, entries, box);
    return;
  }
  const auto widest = std::max_element(
      box.begin(), box.begin() + kNumLead,
      [](const Interval& a, const Interval& b) { return a.high - a.low < b.high - b.low; });
  const auto component = static_cast<std::size_t>(widest - box.begin());
  const std::int32_t cut = widest->low + (widest->high - widest->low + 1) / 2;
  const auto middle = std::partition(entries.begin(), entries.end(),
                                     [&](std::uint32_t i) { return keys.Key(i)[component] < cut; });
  auto num_first = static_cast<std::size_t>(middle - entries.begin());
  // Keys that are all alike are halved: they are as near on either side.
  if (num_first == 0 || num_first == entries.size()) num_first = entries.size() / 2;
  for (const std::span<std::uint32_t> part :
       {entries.first(num_first), entries.subspan(num_first)}) {
    Build(keys, part, BoxOf(keys, part));
  }
}

void KeyTree::AppendLeaf(const Keys& keys, std::span<const std::uint32_t> entries, const Box& box) {
  const std::size_t lane = leaves_.size() % kNumBoxes;
  if (lane == 0) boxes_.emplace_back();
  for (std::size_t c = 0; c < keys.size; ++c) {
    boxes_.back().low[c * kNumBoxes + lane] = static_cast<std::int16_t>(box[c].low);
    boxes_.back().high[c * kNumBoxes + lane] = static_cast<std::int16_t>(box[c].high);
  }
  const std::size_t first_batch = batches_.num_batches();
  for (std::size_t begin = 0; begin < entries.size(); begin += kNumLanes) {
    std::vector<const std::int16_t*> batch;
    for (const std::uint32_t i :
         entries.subspan(begin, std::min(kNumLanes, entries.size() - begin))) {
      owners_.push_back(i);
      batch.push_back(keys.Key(i));
    }
    batches_.Append(batch);
    owners_.resize(batches_.num_batches() * kNumLanes, kNobody);
  }
  leaves_.push_back({static_cast<std::uint32_t>(first_batch),
                     static_cast<std::uint32_t>(batches_.num_batches() - first_batch)});
}

struct KeyTree::Walk {
  std::vector<KeyBatches::Query> keys;  // the key; if flips are wanted, the reversed one, too
  float rounding;
  std::size_t max_compared;
  std::size_t patience;  // so many candidates are looked at together
  NearestPlaces& nearest;
  /// What is farther by the keys here is of no interest: squared, in the batches' units.
  std::int32_t limit = 0;
  std::vector<Ranked> candidates = {};  // entries
};

void KeyTree::Search(std::span<const std::int32_t> key_cm, const KeyEffort& effort,
                     NearestPlaces& nearest) const {
  const auto quantized = [&](std::span<const std::int32_t> of_cm) {
    std::vector<float> turned(num_held_);
    axes_.Turn(of_cm, turned);
    return batches_.Quantize(turned.data());
  };
  const bool is_exact = effort.max_compared == KeyEffort::kAll;
  Walk walk{
      .keys = {quantized(key_cm)},
      .rounding = kRounding * (static_cast<float>(axes_.NormOf(key_cm)) + greatest_norm_),
      .max_compared = effort.max_compared,
      .patience = is_exact ? std::max(kLeastPatience, 4 * nearest.k()) : 2 * effort.max_compared,
      .nearest = nearest};
  if (has_flips_ && nearest.takes_augmented()) {
    // A key is as far from a reversed one as the reversed key from that.
    walk.keys.push_back(quantized(std::vector<std::int32_t>(key_cm.rbegin(), key_cm.rend())));
  }
  SetReach(walk);
  std::vector<Ranked> queue;  // leaves of the first key, then those of the second
  for (const KeyBatches::Query& key : walk.keys) {
    for (const std::int32_t bound : BoundsOf(key)) {
      queue.push_back({bound, static_cast<std::uint32_t>(queue.size())});
    }
  }
  std::make_heap(queue.begin(), queue.end(), std::greater<>());
  std::size_t num_scanned = 0;
  while (!queue.empty() && queue.front().distance <= walk.limit &&
         num_scanned < effort.max_scanned) {
    const Leaf& leaf = leaves_[queue.front().what % leaves_.size()];
    ScanLeaf(leaf, static_cast<std::uint32_t>(queue.front().what / leaves_.size()), walk);
    num_scanned += leaf.num_batches * kNumLanes;
    std::pop_heap(queue.begin(), queue.end(), std::greater<>());
    queue.pop_back();
  }
  if (walk.candidates.size() > walk.max_compared) Thin(walk);
  Settle(walk);
}

std::vector<std::int32_t> KeyTree::BoundsOf(const KeyBatches::Query& key) const {
  std::vector<std::int32_t> bounds(boxes_.size() * kNumBoxes);
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    GapsOf(key.components, boxes_[i].low.data(), boxes_[i].high.data(), &bounds[i * kNumBoxes]);
  }
  bounds.resize(leaves_.size());
  return bounds;
}

void KeyTree::SetReach(Walk& walk) const {
  constexpr float kSlack = 1.00001F;
  const float reach = static_cast<float>(std::sqrt(walk.nearest.reach())) * kSlack + walk.rounding;
  walk.limit = batches_.LimitOf(reach * reach);
}

void KeyTree::ScanLeaf(const Leaf& leaf, std::uint32_t key, Walk& walk) const {
  KeyBatches::Sums sums;
  for (std::size_t i = 0; i < leaf.num_batches; ++i) {
    const std::size_t batch = leaf.first_batch + i;
    std::uint32_t near = batches_.NearLanes(batch, walk.keys[key], walk.limit, sums);
    for (; near != 0; near &= near - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(near));
      const std::uint32_t owner = owners_[batch * kNumLanes + lane];
      if (owner != kNobody) walk.candidates.push_back({sums[lane], owner + key});
    }
    if (walk.candidates.size() < walk.patience) continue;
    if (walk.candidates.size() > walk.max_compared) {
      Thin(walk);
      continue;
    }
    Settle(walk);
    walk.nearest.Narrow();
    SetReach(walk);
  }
}

void KeyTree::Thin(Walk& walk) {
  const auto last = walk.candidates.begin() + static_cast<std::ptrdiff_t>(walk.max_compared - 1);
  std::nth_element(walk.candidates.begin(), last, walk.candidates.end());
  walk.limit = std::min(walk.limit, last->distance);
  walk.candidates.resize(walk.max_compared);
}

void KeyTree::Settle(Walk& walk) const {
  for (const Ranked& candidate : walk.candidates) {
    if (candidate.distance > walk.limit) continue;
    if (walk.nearest.Add(candidate.what)) SetReach(walk);
  }
  walk.candidates.clear();
}

}  // namespace scanloc
