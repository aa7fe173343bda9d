#include "scan_context/key_tree.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace scanloc {
namespace {

constexpr std::size_t kNumLanes = KeyBatches::kNumLanes;

/// What single precision may cost a distance, of the lengths of the keys.
constexpr float kRounding = 1e-6F;

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
  box_ = BoxOf(keys, entries);
  Build(keys, entries, box_);
}

KeyTree::Box KeyTree::BoxOf(const Keys& keys, std::span<const std::uint32_t> entries) {
  Box box;
  for (const std::uint32_t i : entries) {
    const std::int16_t* key = keys.Key(i);
    for (std::size_t c = 0; c < kNumLead; ++c) {
      box[c].low = std::min<std::int32_t>(box[c].low, key[c]);
      box[c].high = std::max<std::int32_t>(box[c].high, key[c]);
    }
  }
  return box;
}

void KeyTree::Build(const Keys& keys, std::span<std::uint32_t> entries, const Box& box) {
  const std::size_t node = nodes_.size();
  nodes_.emplace_back();
  if (entries.size() <= kLeafSize) {
    const std::size_t first_batch = batches_.num_batches();
    AppendLeaf(keys, entries);
    nodes_[node].first_batch = static_cast<std::uint32_t>(first_batch);
    nodes_[node].num_batches = static_cast<std::uint32_t>(batches_.num_batches() - first_batch);
    return;
  }
  const auto widest = std::max_element(
      box.begin(), box.end(),
      [](const Interval& a, const Interval& b) { return a.high - a.low < b.high - b.low; });
  const auto component = static_cast<std::size_t>(widest - box.begin());
  const std::int32_t cut = widest->low + (widest->high - widest->low + 1) / 2;
  const auto middle = std::partition(entries.begin(), entries.end(),
                                     [&](std::uint32_t i) { return keys.Key(i)[component] < cut; });
  auto num_first = static_cast<std::size_t>(middle - entries.begin());
  // Keys that are all alike are halved: they are as near on either side.
  if (num_first == 0 || num_first == entries.size()) num_first = entries.size() / 2;
  const std::span<std::uint32_t> first = entries.first(num_first);
  const std::span<std::uint32_t> second = entries.subspan(num_first);
  nodes_[node].component = static_cast<std::uint32_t>(component);
  const Box first_box = BoxOf(keys, first);
  const Box second_box = BoxOf(keys, second);
  nodes_[node].gap = {first_box[component].high, second_box[component].low};
  Build(keys, first, first_box);
  nodes_[node].second = static_cast<std::uint32_t>(nodes_.size());
  Build(keys, second, second_box);
}

void KeyTree::AppendLeaf(const Keys& keys, std::span<const std::uint32_t> entries) {
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
}

struct KeyTree::Walk {
  KeyBatches::Query key;
  float rounding;
  std::uint32_t offset;
  NearestPlaces& nearest;
  /// What is farther by the keys here is of no interest: squared, in the batches' units.
  std::int32_t limit = 0;
  /// Squared distance of the key from the node at hand, component by component.
  std::array<std::int32_t, kNumLead> gaps{};
};

void KeyTree::Search(std::span<const std::int32_t> key_cm, NearestPlaces& nearest) const {
  SearchFor(key_cm, 0, nearest);
  if (!has_flips_ || !nearest.takes_augmented()) return;
  // A key is as far from a reversed one as the reversed key from that.
  const std::vector<std::int32_t> reversed(key_cm.rbegin(), key_cm.rend());
  SearchFor(reversed, 1, nearest);
}

void KeyTree::SearchFor(std::span<const std::int32_t> key_cm, std::uint32_t offset,
                        NearestPlaces& nearest) const {
  std::vector<float> turned(num_held_);
  axes_.Turn(key_cm, turned);
  Walk walk{.key = batches_.Quantize(turned.data()),
            .rounding = kRounding * (static_cast<float>(axes_.NormOf(key_cm)) + greatest_norm_),
            .offset = offset,
            .nearest = nearest};
  SetReach(walk);
  std::int32_t distance = 0;
  for (std::size_t c = 0; c < kNumLead; ++c) {
    const std::int32_t value = walk.key.components[c];
    const std::int32_t gap = std::max({box_[c].low - value, value - box_[c].high, 0});
    walk.gaps[c] = gap * gap;
    distance += walk.gaps[c];
  }
  if (distance <= walk.limit) Visit(0, distance, walk);
}

void KeyTree::SetReach(Walk& walk) const {
  constexpr float kSlack = 1.00001F;
  const float reach = static_cast<float>(std::sqrt(walk.nearest.reach())) * kSlack + walk.rounding;
  walk.limit = batches_.LimitOf(reach * reach);
}

void KeyTree::AddBatch(std::size_t batch, Walk& walk) const {
  std::uint32_t near = batches_.NearLanes(batch, walk.key, walk.limit);
  for (; near != 0; near &= near - 1) {
    const std::size_t row = batch * kNumLanes + static_cast<std::size_t>(std::countr_zero(near));
    if (owners_[row] == kNobody) continue;
    if (walk.nearest.Add(owners_[row] + walk.offset)) SetReach(walk);
  }
}

void KeyTree::Visit(std::size_t node_index, std::int32_t distance, Walk& walk) const {
  const Node& node = nodes_[node_index];
  if (node.second == 0) {
    for (std::uint32_t i = 0; i < node.num_batches; ++i) AddBatch(node.first_batch + i, walk);
    return;
  }
  const std::int32_t value = walk.key.components[node.component];
  const std::int32_t beyond_low = value - node.gap.low;
  const std::int32_t beyond_high = value - node.gap.high;
  const bool first_is_nearer = beyond_low + beyond_high < 0;
  const std::size_t nearer = first_is_nearer ? node_index + 1 : node.second;
  const std::size_t farther = first_is_nearer ? node.second : node_index + 1;
  Visit(nearer, distance, walk);

  const std::int32_t gap = first_is_nearer ? beyond_high * beyond_high : beyond_low * beyond_low;
  const std::int32_t gap_before = std::exchange(walk.gaps[node.component], gap);
  const std::int32_t farther_distance = distance + gap - gap_before;
  if (farther_distance <= walk.limit) Visit(farther, farther_distance, walk);
  walk.gaps[node.component] = gap_before;
}

}  // namespace scanloc
