#include "scanloc/core/scan_context/key_index.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "scan_context/key_batches.hpp"
#include "scan_context/principal_axes.hpp"

namespace scanloc {
namespace {

/// Components of a key that the tree cuts; they are ordered by variance, and eight have nearly all
/// of it.
constexpr std::size_t kNumLead = 8;

/// A leaf is scanned from front to back: sixteen keys side by side cost less than finding out which
/// of them to leave out.
constexpr std::size_t kLeafSize = 512;

constexpr std::size_t kNumLanes = KeyBatches::kNumLanes;

/// Components are added four side by side in a fixed order: SIMD does not change a bit.
constexpr std::size_t kBlockSize = 4;
using Block = Eigen::Array4f;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A key on the principal axes, padded with zeros to kNumLead and whole blocks.
std::vector<float> PaddedKey(const PrincipalAxes& axes, std::span<const std::int32_t> key_cm) {
  const Eigen::VectorXf turned = axes.Turn(key_cm);
  const auto size = std::max(kNumLead, static_cast<std::size_t>(turned.size()));
  std::vector<float> key_m((size + kBlockSize - 1) / kBlockSize * kBlockSize, 0.0F);
  std::copy(turned.begin(), turned.end(), key_m.begin());
  return key_m;
}

/// Keys in the order of the table.
struct PaddedKeys {
  PaddedKeys(const ContextTable& table, const PrincipalAxes& axes) : num_keys(table.size()) {
    for (std::size_t i = 0; i < num_keys; ++i) {
      const std::vector<float> key_m = PaddedKey(axes, table.retrieval_key_cm(i));
      size = key_m.size();
      components_m.insert(components_m.end(), key_m.begin(), key_m.end());
    }
  }

  std::size_t num_keys = 0;
  std::size_t size = kNumLead;  // of one
  std::vector<float> components_m;

  [[nodiscard]] const float* Key(std::size_t i) const { return components_m.data() + i * size; }
};

struct Interval {
  float low = kInfinity;
  float high = -kInfinity;

  void Add(float value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] float length() const { return high - low; }
};
/// What of the leading components keys span.
using Box = std::array<Interval, kNumLead>;

Box BoxOf(const PaddedKeys& keys, std::span<const std::uint32_t> entries) {
  Box box;
  for (const std::uint32_t i : entries) {
    for (std::size_t c = 0; c < kNumLead; ++c) box[c].Add(keys.Key(i)[c]);
  }
  return box;
}

/// Keys in the order of the tree's leaves, in batches of kNumLanes rows; the last batch of a leaf
/// is filled up with rows that nobody owns.
struct KeyRows {
  struct Owner {
    std::int32_t place = -1;
    std::uint32_t entry = 0;  // of the table
    bool augmented = false;
  };

  std::size_t key_size = 0;
  std::vector<float> components_m;  // row, component
  std::vector<Owner> owners;        // by row
  KeyBatches batches;

  [[nodiscard]] const float* Key(std::size_t row) const {
    return components_m.data() + row * key_size;
  }

  void AppendLeaf(const ContextTable& table, const PaddedKeys& keys,
                  std::span<const std::uint32_t> entries) {
    for (std::size_t begin = 0; begin < entries.size(); begin += kNumLanes) {
      std::vector<const float*> batch;
      for (const std::uint32_t i :
           entries.subspan(begin, std::min(kNumLanes, entries.size() - begin))) {
        const ContextTable::Entry& entry = table.entry(i);
        owners.push_back({entry.place, i, entry.augmented});
        batch.push_back(keys.Key(i));
        components_m.insert(components_m.end(), batch.back(), batch.back() + key_size);
      }
      batches.Append(batch);
      owners.resize(batches.num_batches() * kNumLanes);
      components_m.resize(owners.size() * key_size);
    }
  }
};

/// The k nearest places, one entry a place.
///
/// Ordered by (distance, entry), so that the result does not depend on the order in which the tree
/// is walked, nor on its shape.
class NearestPlaces {
 public:
  NearestPlaces(const KeyRows& rows, const std::vector<float>& key_m, std::size_t k, bool augmented,
                const std::vector<bool>* excluded)
      : rows_(rows),
        key_m_(key_m),
        query_(rows.batches.Quantize(key_m.data())),
        k_(k),
        augmented_(augmented),
        excluded_(excluded) {
    found_.reserve(k + 1);
  }

  /// Squared; nothing at this distance or beyond is of interest.
  [[nodiscard]] float reach() const { return reach_; }

  void AddBatch(std::size_t batch) {
    std::uint32_t near = rows_.batches.NearLanes(batch, query_, limit_);
    for (; near != 0; near &= near - 1) {
      Add(batch * kNumLanes + static_cast<std::size_t>(std::countr_zero(near)));
    }
  }

  [[nodiscard]] std::vector<KeyIndex::Neighbor> Neighbors() const {
    std::vector<KeyIndex::Neighbor> neighbors;
    neighbors.reserve(found_.size());
    for (const Found& f : found_) neighbors.push_back({f.entry, std::sqrt(double{f.distance})});
    return neighbors;
  }

 private:
  struct Found {
    float distance;  // squared
    std::uint32_t entry;
    std::int32_t place;
    bool operator<(const Found& other) const {
      return distance != other.distance ? distance < other.distance : entry < other.entry;
    }
  };

  void Add(std::size_t row) {
    const KeyRows::Owner& owner = rows_.owners[row];
    if (owner.place < 0 || (!augmented_ && owner.augmented)) return;
    const Found candidate{SquaredDistance(row), owner.entry, owner.place};
    if (found_.size() == k_ && !(candidate < found_.back())) return;
    if (excluded_ != nullptr && (*excluded_)[static_cast<std::size_t>(owner.place)]) return;
    Insert(candidate);
  }

  [[nodiscard]] float SquaredDistance(std::size_t row) const {
    const float* row_m = rows_.Key(row);
    Block sums = Block::Zero();
    for (std::size_t i = 0; i < rows_.key_size; i += kBlockSize) {
      sums += (Eigen::Map<const Block>(key_m_.data() + i) - Eigen::Map<const Block>(row_m + i))
                  .square();
    }
    return (sums[0] + sums[2]) + (sums[1] + sums[3]);
  }

  void Insert(const Found& candidate) {
    const auto same = std::find_if(found_.begin(), found_.end(),
                                   [&](const Found& f) { return f.place == candidate.place; });
    if (same != found_.end()) {
      if (!(candidate < *same)) return;
      found_.erase(same);
    } else if (found_.size() == k_) {
      found_.pop_back();
    }
    found_.insert(std::upper_bound(found_.begin(), found_.end(), candidate), candidate);
    if (found_.size() == k_) {
      // Ties are let in, and what rounding on the way to a branch might cost.
      constexpr float kSlack = 1.00001F;
      reach_ = std::nextafter(found_.back().distance * kSlack, kInfinity);
      limit_ = rows_.batches.LimitOf(reach_);
    }
  }

  const KeyRows& rows_;
  const std::vector<float>& key_m_;
  const KeyBatches::Query query_;
  std::size_t k_;
  bool augmented_;
  const std::vector<bool>* excluded_;
  float reach_ = kInfinity;
  std::int32_t limit_ = std::numeric_limits<std::int32_t>::max();
  std::vector<Found> found_;
};

}  // namespace

/// A k-d tree with large leaves, in which a processor compares many keys side by side.
struct KeyIndex::Tree {
  Tree(const ContextTable& table, KeyScale scale) : axes(table, scale) {
    const PaddedKeys keys(table, axes);
    if (keys.num_keys == 0) return;
    rows.key_size = keys.size;
    rows.batches = KeyBatches(keys.components_m, keys.size);
    std::vector<std::uint32_t> entries(keys.num_keys);
    std::iota(entries.begin(), entries.end(), 0U);
    box_ = BoxOf(keys, entries);
    Build(table, keys, entries, box_);
  }

  void Search(const std::vector<float>& key_m, NearestPlaces& nearest) const {
    Gaps gaps{};
    float distance = 0.0F;
    for (std::size_t c = 0; c < kNumLead; ++c) {
      const float gap = std::max({box_[c].low - key_m[c], key_m[c] - box_[c].high, 0.0F});
      gaps[c] = gap * gap;
      distance += gaps[c];
    }
    Visit(0, key_m, distance, gaps, nearest);
  }

  PrincipalAxes axes;
  KeyRows rows;

 private:
  /// Squared distance of a key from the node at hand, component by component.
  using Gaps = std::array<float, kNumLead>;

  /// A leaf has no second child; the first child of an inner node follows it.
  struct Node {
    std::uint32_t second = 0;
    std::uint32_t component = 0;  // where it is cut
    Interval gap;                 // no key lies in it: the first child ends, the second begins
    std::uint32_t first_batch = 0;
    std::uint32_t num_batches = 0;
  };

  /// Cuts the widest component in its middle until few enough keys are left for a leaf.
  void Build(const ContextTable& table, const PaddedKeys& keys, std::span<std::uint32_t> entries,
             const Box& box) {
    const std::size_t node = nodes_.size();
    nodes_.emplace_back();
    if (entries.size() <= kLeafSize) {
      const std::size_t first_batch = rows.batches.num_batches();
      rows.AppendLeaf(table, keys, entries);
      nodes_[node].first_batch = static_cast<std::uint32_t>(first_batch);
      nodes_[node].num_batches =
          static_cast<std::uint32_t>(rows.batches.num_batches() - first_batch);
      return;
    }
    const auto widest = std::max_element(
        box.begin(), box.end(),
        [](const Interval& a, const Interval& b) { return a.length() < b.length(); });
    const auto component = static_cast<std::size_t>(widest - box.begin());
    const float cut = widest->low + widest->length() / 2.0F;
    const auto middle = std::partition(entries.begin(), entries.end(), [&](std::uint32_t i) {
      return keys.Key(i)[component] < cut;
    });
    auto num_first = static_cast<std::size_t>(middle - entries.begin());
    // Keys that are all alike are halved: they are as near on either side.
    if (num_first == 0 || num_first == entries.size()) num_first = entries.size() / 2;
    const std::span<std::uint32_t> first = entries.first(num_first);
    const std::span<std::uint32_t> second = entries.subspan(num_first);
    nodes_[node].component = static_cast<std::uint32_t>(component);
    const Box first_box = BoxOf(keys, first);
    const Box second_box = BoxOf(keys, second);
    nodes_[node].gap = {first_box[component].high, second_box[component].low};
    Build(table, keys, first, first_box);
    nodes_[node].second = static_cast<std::uint32_t>(nodes_.size());
    Build(table, keys, second, second_box);
  }

  /// Visits what of the subtree may hold nearer keys, the nearer child first. `distance` is the sum
  /// of the gaps, a lower bound of the distance to any key of the subtree.
  void Visit(std::size_t node_index, const std::vector<float>& key_m, float distance, Gaps& gaps,
             NearestPlaces& nearest) const {
    const Node& node = nodes_[node_index];
    if (node.second == 0) {
      for (std::uint32_t i = 0; i < node.num_batches; ++i) nearest.AddBatch(node.first_batch + i);
      return;
    }
    const float value = key_m[node.component];
    const float beyond_low = value - node.gap.low;
    const float beyond_high = value - node.gap.high;
    const bool first_is_nearer = beyond_low + beyond_high < 0.0F;
    const std::size_t nearer = first_is_nearer ? node_index + 1 : node.second;
    const std::size_t farther = first_is_nearer ? node.second : node_index + 1;
    Visit(nearer, key_m, distance, gaps, nearest);

    const float gap = first_is_nearer ? beyond_high * beyond_high : beyond_low * beyond_low;
    const float gap_before = std::exchange(gaps[node.component], gap);
    const float farther_distance = distance + gap - gap_before;
    if (farther_distance <= nearest.reach()) {
      Visit(farther, key_m, farther_distance, gaps, nearest);
    }
    gaps[node.component] = gap_before;
  }

  Box box_;
  std::vector<Node> nodes_;  // the root first
};

KeyIndex::KeyIndex(const ContextTable& table, KeyScale scale)
    : tree_(std::make_unique<Tree>(table, scale)) {}

KeyIndex::KeyIndex(KeyIndex&&) noexcept = default;
KeyIndex& KeyIndex::operator=(KeyIndex&&) noexcept = default;
KeyIndex::~KeyIndex() = default;

std::vector<KeyIndex::Neighbor> KeyIndex::Search(std::span<const std::int32_t> retrieval_cm, int k,
                                                 bool augmented,
                                                 const std::vector<bool>* excluded) const {
  if (k <= 0 || tree_->rows.owners.empty()) return {};
  const std::vector<float> key_m = PaddedKey(tree_->axes, retrieval_cm);
  NearestPlaces nearest(tree_->rows, key_m, static_cast<std::size_t>(k), augmented, excluded);
  tree_->Search(key_m, nearest);
  return nearest.Neighbors();
}

}  // namespace scanloc
