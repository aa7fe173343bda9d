#include "scanloc/core/scan_context/key_index.hpp"

#include <algorithm>
#include <cmath>

#include "map/forest.hpp"
#include "scan_context/key_tree.hpp"
#include "scan_context/nearest_places.hpp"

namespace scanloc {

KeyEffort EffortFor(std::size_t num_places, int k) {
  // Half as many compared find 7 fewer of 500 scans in a town of 33,332 places, an exact search
  // finds 2 more (docs/algorithm.md, "As the map grows").
  constexpr double kNumScanned = 65'536;
  constexpr std::size_t kNumComparedForOne = 8;
  if (num_places <= kMaxExactPlaces) return {};
  const double growth = static_cast<double>(num_places) / static_cast<double>(kMaxExactPlaces);
  return {.max_scanned = static_cast<std::size_t>(kNumScanned * std::sqrt(growth)),
          .max_compared = kNumComparedForOne * static_cast<std::size_t>(std::max(1, k))};
}

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
                                                 bool augmented, const std::vector<bool>* excluded,
                                                 const KeyEffort& effort) const {
  if (k <= 0) return {};
  const KeyDistance distance(trees_->scale, retrieval_cm);
  NearestPlaces nearest(trees_->table, distance, static_cast<std::size_t>(k), augmented, excluded);
  trees_->forest.ForEach([&](const KeyTree& tree) { tree.Search(retrieval_cm, effort, nearest); });
  for (std::size_t i = trees_->forest.covered(); i < trees_->table.size(); ++i) {
    nearest.Add(static_cast<std::uint32_t>(i));
  }
  return nearest.Neighbors();
}

}  // namespace scanloc
