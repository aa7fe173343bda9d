#include "scan_context/key_tree.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

namespace scanloc {
namespace {

constexpr std::size_t kNumLanes = KeyBatches::kNumLanes;

/// Components side by side in a register.
constexpr std::size_t kBlockSize = 4;
using Block = Eigen::Array4f;

/// What single precision may cost a distance, of the lengths of the keys.
constexpr float kRounding = 1e-6F;

float NormOf(const float* key, std::size_t size) {
  return Eigen::Map<const Eigen::VectorXf>(key, static_cast<Eigen::Index>(size)).norm();
}

/// A key on the principal axes, padded with zeros to the components that the tree cuts and to whole
/// blocks.
std::vector<float> TurnedKey(const PrincipalAxes& axes, std::span<const std::int32_t> key_cm,
                             std::size_t num_lead) {
  const Eigen::VectorXf turned = axes.Turn(key_cm);
  const auto size = std::max(num_lead, static_cast<std::size_t>(turned.size()));
  std::vector<float> key((size + kBlockSize - 1) / kBlockSize * kBlockSize, 0.0F);
  std::copy(turned.begin(), turned.end(), key.begin());
  return key;
}

}  // namespace

/// The turned keys of a range of a table's entries, in its order.
struct KeyTree::Keys {
  Keys(const ContextTable& table, const PrincipalAxes& axes, std::size_t first_entry,
       std::size_t end)
      : begin(first_entry) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::vector<float> key = TurnedKey(axes, table.retrieval_key_cm(i), kNumLead);
      size = key.size();
      components.insert(components.end(), key.begin(), key.end());
    }
  }

  std::size_t begin;
  std::size_t size = kNumLead;  // of one
  std::vector<float> components;

  [[nodiscard]] const float* Key(std::size_t entry) const {
    return components.data() + (entry - begin) * size;
  }
};

KeyTree::KeyTree(const ContextTable& table, KeyScale scale, std::size_t begin, std::size_t end)
    : axes_(table, scale, begin, end) {
  const Keys keys(table, axes_, begin, end);
  batches_ = KeyBatches(keys.components, keys.size);
  std::vector<std::uint32_t> entries(end - begin);
  std::iota(entries.begin(), entries.end(), static_cast<std::uint32_t>(begin));
  for (const std::uint32_t entry : entries) {
    greatest_norm_ = std::max(greatest_norm_, NormOf(keys.Key(entry), keys.size));
  }
  box_ = BoxOf(keys, entries);
  Build(keys, entries, box_);
}

KeyTree::Box KeyTree::BoxOf(const Keys& keys, std::span<const std::uint32_t> entries) {
  Box box;
  for (const std::uint32_t i : entries) {
    const float* key = keys.Key(i);
    for (std::size_t c = 0; c < kNumLead; ++c) {
      box[c] = {std::min(box[c].low, key[c]), std::max(box[c].high, key[c])};
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
  const float cut = widest->low + (widest->high - widest->low) / 2.0F;
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
    std::vector<const float*> batch;
    for (const std::uint32_t i :
         entries.subspan(begin, std::min(kNumLanes, entries.size() - begin))) {
      owners_.push_back(i);
      batch.push_back(keys.Key(i));
      rows_.insert(rows_.end(), batch.back(), batch.back() + keys.size);
    }
    batches_.Append(batch);
    owners_.resize(batches_.num_batches() * kNumLanes, kNobody);
    rows_.resize(owners_.size() * keys.size);
  }
}

struct KeyTree::Walk {
  const std::vector<float>& key;
  KeyBatches::Query batch_query;
  float rounding;
  NearestPlaces& nearest;
  float reach = 0.0F;      // squared: what is farther by the keys here is of no interest
  std::int32_t limit = 0;  // the same for the batches
  /// Squared distance of the key from the node at hand, component by component.
  std::array<float, kNumLead> gaps{};
};

void KeyTree::Search(std::span<const std::int32_t> key_cm, NearestPlaces& nearest) const {
  const std::vector<float> key = TurnedKey(axes_, key_cm, kNumLead);
  Walk walk{.key = key,
            .batch_query = batches_.Quantize(key.data()),
            .rounding = kRounding * (NormOf(key.data(), key.size()) + greatest_norm_),
            .nearest = nearest};
  SetReach(walk);
  float distance = 0.0F;
  for (std::size_t c = 0; c < kNumLead; ++c) {
    const float gap = std::max({box_[c].low - key[c], key[c] - box_[c].high, 0.0F});
    walk.gaps[c] = gap * gap;
    distance += walk.gaps[c];
  }
  if (distance <= walk.reach) Visit(0, distance, walk);
}

void KeyTree::SetReach(Walk& walk) const {
  constexpr float kSlack = 1.00001F;
  const float reach = static_cast<float>(std::sqrt(walk.nearest.reach())) * kSlack + walk.rounding;
  walk.reach = reach * reach;
  walk.limit = batches_.LimitOf(walk.reach);
}

void KeyTree::AddBatch(std::size_t batch, Walk& walk) const {
  std::uint32_t near = batches_.NearLanes(batch, walk.batch_query, walk.limit);
  for (; near != 0; near &= near - 1) {
    const std::size_t row = batch * kNumLanes + static_cast<std::size_t>(std::countr_zero(near));
    if (owners_[row] == kNobody || SquaredDistance(row, walk.key) > walk.reach) continue;
    if (walk.nearest.Add(owners_[row])) SetReach(walk);
  }
}

/// Rounded: tells cheaply what need not be compared exactly.
float KeyTree::SquaredDistance(std::size_t row, const std::vector<float>& key) const {
  const float* row_key = rows_.data() + row * key.size();
  Block sums = Block::Zero();
  for (std::size_t i = 0; i < key.size(); i += kBlockSize) {
    sums +=
        (Eigen::Map<const Block>(key.data() + i) - Eigen::Map<const Block>(row_key + i)).square();
  }
  return (sums[0] + sums[2]) + (sums[1] + sums[3]);
}

void KeyTree::Visit(std::size_t node_index, float distance, Walk& walk) const {
  const Node& node = nodes_[node_index];
  if (node.second == 0) {
    for (std::uint32_t i = 0; i < node.num_batches; ++i) AddBatch(node.first_batch + i, walk);
    return;
  }
  const float value = walk.key[node.component];
  const float beyond_low = value - node.gap.low;
  const float beyond_high = value - node.gap.high;
  const bool first_is_nearer = beyond_low + beyond_high < 0.0F;
  const std::size_t nearer = first_is_nearer ? node_index + 1 : node.second;
  const std::size_t farther = first_is_nearer ? node.second : node_index + 1;
  Visit(nearer, distance, walk);

  const float gap = first_is_nearer ? beyond_high * beyond_high : beyond_low * beyond_low;
  const float gap_before = std::exchange(walk.gaps[node.component], gap);
  const float farther_distance = distance + gap - gap_before;
  if (farther_distance <= walk.reach) Visit(farther, farther_distance, walk);
  walk.gaps[node.component] = gap_before;
}

}  // namespace scanloc
