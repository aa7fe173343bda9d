#include "scanloc/core/key_index.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

namespace scanloc {
namespace {

/// Keys as nanoflann wants to read them: one row of metres an entry.
struct KeyRows {
  int num_rows = 0;
  std::vector<float> values_m;
  std::vector<ContextTable::Entry> entries;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return entries.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t entry, std::size_t row) const {
    return values_m[entry * static_cast<std::size_t>(num_rows) + row];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

/// The k nearest places, one entry a place, for nanoflann to fill.
///
/// Ordered by (distance, entry), so that the result does not depend on the order in which the tree
/// is walked, nor on its shape.
class NearestPlaces {
 public:
  using DistanceType = float;

  NearestPlaces(const std::vector<ContextTable::Entry>& entries, std::size_t k, bool augmented)
      : entries_(entries), k_(k), augmented_(augmented) {
    found_.reserve(k + 1);
  }

  [[nodiscard]] std::size_t size() const { return found_.size(); }
  [[nodiscard]] bool full() const { return found_.size() == k_; }
  // nanoflann passes over what is not nearer than this: the next float keeps ties in.
  // NOLINTNEXTLINE(readability-identifier-naming): nanoflann calls it so.
  [[nodiscard]] float worstDist() const {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    return full() ? std::nextafter(found_.back().distance, kInfinity) : kInfinity;
  }

  // NOLINTNEXTLINE(readability-identifier-naming): nanoflann calls it so.
  bool addPoint(float distance, std::uint32_t entry) {
    if (!augmented_ && entries_[entry].augmented) return true;
    const Found candidate{distance, entry};
    if (full() && !(candidate < found_.back())) return true;
    const std::int32_t place = entries_[entry].place;
    const auto same = std::find_if(found_.begin(), found_.end(), [&](const Found& f) {
      return entries_[f.entry].place == place;
    });
    if (same != found_.end()) {
      if (!(candidate < *same)) return true;
      found_.erase(same);
    } else if (full()) {
      found_.pop_back();
    }
    found_.insert(std::upper_bound(found_.begin(), found_.end(), candidate), candidate);
    return true;
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
    bool operator<(const Found& other) const {
      return distance != other.distance ? distance < other.distance : entry < other.entry;
    }
  };
  const std::vector<ContextTable::Entry>& entries_;
  std::size_t k_;
  bool augmented_;
  std::vector<Found> found_;
};

constexpr std::size_t kLeafSize = 16;

std::vector<float> ToMetres(std::span<const std::int32_t> key_cm) {
  std::vector<float> key_m(key_cm.size());
  std::transform(key_cm.begin(), key_cm.end(), key_m.begin(),
                 [](std::int32_t value_cm) { return static_cast<float>(value_cm) * 0.01F; });
  return key_m;
}

}  // namespace

struct KeyIndex::Tree {
  using Index = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Adaptor<float, KeyRows>, KeyRows,
                                                    -1, std::uint32_t>;

  explicit Tree(KeyRows rows_in)
      : rows(std::move(rows_in)),
        index(rows.num_rows, rows, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafSize)) {}

  KeyRows rows;
  Index index;
};

KeyIndex::KeyIndex(const ContextTable& table) {
  KeyRows rows;
  rows.num_rows = table.num_rows();
  rows.values_m.reserve(table.size() * static_cast<std::size_t>(table.num_rows()));
  rows.entries.reserve(table.size());
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::vector<float> key_m = ToMetres(table.retrieval_key_cm(i));
    rows.values_m.insert(rows.values_m.end(), key_m.begin(), key_m.end());
    rows.entries.push_back(table.entry(i));
  }
  tree_ = std::make_unique<Tree>(std::move(rows));
}

KeyIndex::KeyIndex(KeyIndex&&) noexcept = default;
KeyIndex& KeyIndex::operator=(KeyIndex&&) noexcept = default;
KeyIndex::~KeyIndex() = default;

std::vector<KeyIndex::Neighbor> KeyIndex::Search(std::span<const std::int32_t> retrieval_cm, int k,
                                                 bool augmented) const {
  if (k <= 0 || tree_->rows.entries.empty()) return {};
  const std::vector<float> key_m = ToMetres(retrieval_cm);
  NearestPlaces nearest(tree_->rows.entries, static_cast<std::size_t>(k), augmented);
  tree_->index.findNeighbors(nearest, key_m.data(), nanoflann::SearchParams());
  return nearest.Neighbors();
}

}  // namespace scanloc
