#include "scan_context/key_tree.hpp"

#include <algorithm>

#include "scan/simd.hpp"

namespace scanloc {
namespace {

constexpr std::size_t kNumLanes = KeyBatches::kNumLanes;

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

constexpr std::size_t kNumBoxes = 16;

/// Of so many components that lie side by side.
constexpr std::size_t kWidened = 8;

void Widen(const std::int16_t* key, std::int16_t* low, std::int16_t* high) {
  for (std::size_t c = 0; c < kWidened; ++c) {
    low[c] = std::min(low[c], key[c]);
    high[c] = std::max(high[c], key[c]);
  }
}

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
  std::size_t step;  // from entry to entry that is held
  std::size_t size;  // of one
  std::vector<std::int16_t> components;

  /// Of an entry so far behind the first.
  [[nodiscard]] const std::int16_t* Key(std::size_t entry) const {
    return components.data() + entry / step * size;
  }
};

KeyTree::KeyTree(const ContextTable& table, std::size_t begin, std::size_t end)
    : num_held_(std::min(kMaxHeld, (static_cast<std::size_t>(table.num_rows()) * 4 + 4) / 5)),
      has_flips_(table.has_flips()),
      axes_(table, Sample(begin, end, has_flips_ ? 2 : 1)) {
  const std::size_t step = has_flips_ ? 2 : 1;
  batches_ = KeyBatches(TurnedKeys(table, axes_, num_held_, Sample(begin, end, step)), num_held_);
  Keys keys{step, batches_.key_size(), {}};
  std::vector<std::uint32_t> entries;
  entries.reserve((end - begin) / step);
  keys.components.reserve((end - begin) / step * keys.size);
  std::vector<std::int32_t> key_cm(static_cast<std::size_t>(table.num_rows()));
  std::vector<float> turned(num_held_);
  for (std::size_t i = begin; i < end; i += step) {
    table.ReadRetrievalKey(i, key_cm);
    greatest_norm_ = std::max(greatest_norm_, static_cast<float>(axes_.Turn(key_cm, turned)));
    const std::size_t size = keys.components.size();
    keys.components.resize(size + keys.size);
    batches_.Quantize(turned.data(), std::span(keys.components).subspan(size));
    entries.push_back(static_cast<std::uint32_t>(i - begin));
  }
  Build(keys, entries);
  batches_.ShrinkToFit();
  owners_.shrink_to_fit();
}

KeyTree::Box KeyTree::BoxOf(const Keys& keys, std::span<const std::uint32_t> entries,
                            std::size_t num_components) {
  std::array<std::int16_t, kMaxHeld> low;
  std::array<std::int16_t, kMaxHeld> high;
  low.fill(std::numeric_limits<std::int16_t>::max());
  high.fill(std::numeric_limits<std::int16_t>::min());
  for (const std::uint32_t i : entries) {
    for (std::size_t c = 0; c < num_components; c += kWidened) {
      Widen(keys.Key(i) + c, &low[c], &high[c]);
    }
  }
  Box box;
  for (std::size_t c = 0; c < kMaxHeld; ++c) box[c] = {low[c], high[c]};
  return box;
}

void KeyTree::Build(const Keys& keys, std::span<std::uint32_t> entries) {
  if (entries.size() <= kLeafSize) {
    AppendLeaf(keys, entries);
    return;
  }
  const Box box = BoxOf(keys, entries, kNumLead);
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
    Build(keys, part);
  }
}

void KeyTree::AppendLeaf(const Keys& keys, std::span<const std::uint32_t> entries) {
  const Box box = BoxOf(keys, entries, keys.size);
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

KeyTree::Turned KeyTree::TurnedKey(std::span<const std::int32_t> key_cm) const {
  std::vector<float> turned(num_held_);
  const double norm = axes_.Turn(key_cm, turned);
  return {batches_.Quantize(turned.data()), static_cast<float>(norm)};
}

std::vector<std::int32_t> KeyTree::BoundsOf(const KeyBatches::Query& key) const {
  std::vector<std::int32_t> bounds(boxes_.size() * kNumBoxes);
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    GapsOf(key.components, boxes_[i].low.data(), boxes_[i].high.data(), &bounds[i * kNumBoxes]);
  }
  bounds.resize(leaves_.size());
  return bounds;
}

}  // namespace scanloc
