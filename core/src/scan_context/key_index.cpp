#include "scanloc/core/scan_context/key_index.hpp"

#include "map/forest.hpp"
#include "scan_context/key_tree.hpp"
#include "scan_context/nearest_places.hpp"

namespace scanloc {

struct KeyIndex::Trees {
  const ContextTable& table;
  KeyScale scale;
  Forest<KeyTree> forest;
};

KeyIndex::KeyIndex(const ContextTable& table, KeyScale scale)
    : trees_(std::make_unique<Trees>(Trees{table, scale, {}})) {
  Extend();
}

KeyIndex::KeyIndex(KeyIndex&&) noexcept = default;
KeyIndex& KeyIndex::operator=(KeyIndex&&) noexcept = default;
KeyIndex::~KeyIndex() = default;

void KeyIndex::Extend() {
  const ContextTable& table = trees_->table;
  const std::size_t size = table.has_flips() ? table.size() / 2 * 2 : table.size();
  trees_->forest.Grow(size, KeyTree::kLeafSize, [&](std::size_t begin, std::size_t end) {
    return std::make_unique<const KeyTree>(table, trees_->scale, begin, end);
  });
}

std::vector<KeyIndex::Neighbor> KeyIndex::Search(std::span<const std::int32_t> retrieval_cm, int k,
                                                 bool augmented,
                                                 const std::vector<bool>* excluded) const {
  if (k <= 0) return {};
  const KeyDistance distance(trees_->scale, retrieval_cm);
  NearestPlaces nearest(trees_->table, distance, static_cast<std::size_t>(k), augmented, excluded);
  trees_->forest.ForEach([&](const KeyTree& tree) { tree.Search(retrieval_cm, nearest); });
  for (std::size_t i = trees_->forest.covered(); i < trees_->table.size(); ++i) {
    nearest.Add(static_cast<std::uint32_t>(i));
  }
  return nearest.Neighbors();
}

}  // namespace scanloc
