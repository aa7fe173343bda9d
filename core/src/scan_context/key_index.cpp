#include "scanloc/core/scan_context/key_index.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "map/forest.hpp"
#include "scan_context/key_search.hpp"
#include "scan_context/key_tree.hpp"
#include "scan_context/nearest_places.hpp"

namespace scanloc {
namespace {

double GrowthOf(std::size_t num_places) {
  return static_cast<double>(num_places) / static_cast<double>(kMaxExactPlaces);
}

}  // namespace

KeyEffort EffortFor(std::size_t num_places, int k) {
  constexpr double kNumScanned = 65'536;
  constexpr double kGrowthOfScanned = 0.4;
  // What a tree holds of a key tells the order nearly as all of it does.
  constexpr std::size_t kNumComparedForOne = 2;
  if (num_places <= kMaxExactPlaces) return {};
  const auto num_found = static_cast<std::size_t>(std::max(1, k));
  const double growth = GrowthOf(num_places);
  return {.max_scanned = static_cast<std::size_t>(kNumScanned * std::pow(growth, kGrowthOfScanned)),
          .max_compared = kNumComparedForOne * num_found};
}

int NumToFind(std::size_t num_places, int k) {
  const double growth = std::max(1.0, GrowthOf(num_places));
  return static_cast<int>(k * std::sqrt(std::sqrt(std::sqrt(growth))));
}

struct KeyIndex::Trees {
  const ContextTable& table;
  KeyScale scale;
  std::vector<std::shared_ptr<const KeyTree>> full;  // one a full block of keys
  Forest<KeyTree> last;                              // of the keys behind these

  /// The first entry that is in no tree of a full block.
  [[nodiscard]] std::size_t FirstOfLast() const {
    const std::size_t num_keys = full.empty() ? 0 : table.key_blocks().ends()[full.size() - 1];
    return num_keys * (table.has_flips() ? 2 : 1);
  }
};

KeyIndex::KeyIndex(const ContextTable& table, KeyScale scale, const KeyIndex* before)
    : trees_(std::make_unique<Trees>(Trees{table, scale, {}, {}})) {
  Grow(before != nullptr && before->trees_->scale == scale ? before : nullptr);
}

KeyIndex::KeyIndex(KeyIndex&&) noexcept = default;
KeyIndex& KeyIndex::operator=(KeyIndex&&) noexcept = default;
KeyIndex::~KeyIndex() = default;

void KeyIndex::Extend() { Grow(nullptr); }

void KeyIndex::Grow(const KeyIndex* before) {
  Trees& trees = *trees_;
  const ContextTable& table = trees.table;
  const std::size_t step = table.has_flips() ? 2 : 1;
  const std::size_t size = table.size() / step * step;
  const std::vector<std::size_t>& ends = table.key_blocks().ends();
  while (trees.full.size() < ends.size() && ends[trees.full.size()] * step <= size) {
    const std::size_t number = trees.full.size();
    std::shared_ptr<const KeyTree> tree =
        before == nullptr ? nullptr : before->TreeOf(table, number);
    if (tree == nullptr) {
      tree = std::make_shared<const KeyTree>(table, trees.scale, trees.FirstOfLast(),
                                             ends[number] * step);
    }
    trees.full.push_back(std::move(tree));
    trees.last = {};
  }
  const std::size_t first = trees.FirstOfLast();
  trees.last.Grow(size - first, KeyTree::kLeafSize, [&](std::size_t begin, std::size_t end) {
    return std::make_unique<const KeyTree>(table, trees.scale, first + begin, first + end);
  });
}

std::shared_ptr<const KeyTree> KeyIndex::TreeOf(const ContextTable& other,
                                                std::size_t number) const {
  const ContextTable& table = trees_->table;
  if (table.has_flips() != other.has_flips()) return nullptr;
  const auto& blocks = table.key_blocks().full();
  const auto same = std::find(blocks.begin(), blocks.end(), other.key_blocks().full()[number]);
  const auto place = static_cast<std::size_t>(same - blocks.begin());
  return place < trees_->full.size() ? trees_->full[place] : nullptr;
}

std::vector<KeyIndex::Neighbor> KeyIndex::Search(std::span<const std::int32_t> retrieval_cm, int k,
                                                 bool augmented, const std::vector<bool>* excluded,
                                                 const KeyEffort& effort) const {
  if (k <= 0) return {};
  const ContextTable& table = trees_->table;
  const KeyDistance distance(trees_->scale, retrieval_cm);
  NearestPlaces nearest(table, distance, static_cast<std::size_t>(k), augmented, excluded);
  std::vector<KeySearch::Part> parts;
  const std::size_t step = table.has_flips() ? 2 : 1;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < trees_->full.size(); ++i) {
    parts.push_back({trees_->full[i].get(), begin});
    begin = table.key_blocks().ends()[i] * step;
  }
  trees_->last.ForEach([&](const KeyTree& tree, std::size_t first) {
    parts.push_back({&tree, begin + first});
  });
  KeySearch(parts, retrieval_cm, effort, nearest).Run();
  for (std::size_t i = begin + trees_->last.covered(); i < table.size(); ++i) {
    nearest.Add(static_cast<std::uint32_t>(i));
  }
  return nearest.Neighbors();
}

}  // namespace scanloc
