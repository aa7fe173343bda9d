#include "scanloc/core/scan_context/key_index.hpp"

#include <algorithm>
#include <utility>

#include "map/forest.hpp"
#include "scan_context/key_search.hpp"
#include "scan_context/key_tree.hpp"
#include "scan_context/nearest_places.hpp"

namespace scanloc {
struct KeyIndex::Trees {
  const ContextTable& table;
  std::vector<std::shared_ptr<const KeyTree>> full;  // one a full block of keys
  Forest<KeyTree> last;                              // of the keys behind these

  /// The first entry that is in no tree of a full block.
  [[nodiscard]] std::size_t FirstOfLast() const {
    const std::size_t num_keys = full.empty() ? 0 : table.key_blocks().ends()[full.size() - 1];
    return num_keys * (table.has_flips() ? 2 : 1);
  }
};

KeyIndex::KeyIndex(const ContextTable& table, const KeyIndex* before)
    : trees_(std::make_unique<Trees>(Trees{table, {}, {}})) {
  Grow(before);
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
      tree = std::make_shared<const KeyTree>(table, trees.FirstOfLast(), ends[number] * step);
    }
    trees.full.push_back(std::move(tree));
    trees.last = {};
  }
  const std::size_t first = trees.FirstOfLast();
  trees.last.Grow(size - first, KeyTree::kLeafSize, [&](std::size_t begin, std::size_t end) {
    return std::make_unique<const KeyTree>(table, first + begin, first + end);
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
                                                 bool augmented,
                                                 const std::vector<bool>* excluded) const {
  if (k <= 0) return {};
  const ContextTable& table = trees_->table;
  const KeyDistance distance(retrieval_cm);
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
  KeySearch(parts, retrieval_cm, nearest).Run();
  for (std::size_t i = begin + trees_->last.covered(); i < table.size(); ++i) {
    nearest.Add(static_cast<std::uint32_t>(i));
  }
  return nearest.Neighbors();
}

}  // namespace scanloc
