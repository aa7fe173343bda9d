#include "scanloc/core/key_index.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>
#include <numeric>

#include "principal_axes.hpp"

namespace scanloc {
namespace {

/// Components of a key that the tree looks at; the rest only adds to the distance of what it lets
/// through. The components are ordered by variance, and eight have nearly all of it.
constexpr std::size_t kNumLead = 8;

/// A leaf is scanned from front to back, which is faster than finding out what of it to leave out.
constexpr std::size_t kLeafSize = 64;

/// Components are added four side by side in a fixed order: SIMD does not change a bit.
constexpr std::size_t kBlockSize = 4;
using Block = Eigen::Array4f;

inline Block SquaredDifference(const float* a, const float* b) {
  return (Eigen::Map<const Block>(a) - Eigen::Map<const Block>(b)).square();
}
inline float Sum(const Block& block) { return (block[0] + block[2]) + (block[1] + block[3]); }

/// A key on the principal axes, padded with zeros to kNumLead and whole blocks.
std::vector<float> PaddedKey(const PrincipalAxes& axes, std::span<const std::int32_t> key_cm) {
  const Eigen::VectorXf turned = axes.Turn(key_cm);
  const auto size = std::max(kNumLead, static_cast<std::size_t>(turned.size()));
  std::vector<float> key_m((size + kBlockSize - 1) / kBlockSize * kBlockSize, 0.0F);
  std::copy(turned.begin(), turned.end(), key_m.begin());
  return key_m;
}

/// Keys, parted into what the tree looks at and the rest.
struct KeyRows {
  struct Owner {
    std::uint32_t entry = 0;  // of the table
    std::int32_t place = 0;
    bool augmented = false;
  };

  std::size_t rest_size = 0;
  std::vector<float> lead_m;
  std::vector<float> rest_m;
  std::vector<Owner> owners;

  [[nodiscard]] const float* Lead(std::size_t row) const { return lead_m.data() + row * kNumLead; }
  [[nodiscard]] const float* Rest(std::size_t row) const { return rest_m.data() + row * rest_size; }

  // What nanoflann asks for.
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return owners.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t row, std::size_t component) const {
    return Lead(row)[component];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }

  void Append(const float* row_lead_m, const float* row_rest_m, const Owner& owner) {
    lead_m.insert(lead_m.end(), row_lead_m, row_lead_m + kNumLead);
    rest_m.insert(rest_m.end(), row_rest_m, row_rest_m + rest_size);
    owners.push_back(owner);
  }

  /// Row i of the result is row order[i].
  [[nodiscard]] KeyRows InOrder(const std::vector<std::uint32_t>& order) const {
    KeyRows rows{.rest_size = rest_size};
    rows.lead_m.reserve(lead_m.size());
    rows.rest_m.reserve(rest_m.size());
    rows.owners.reserve(owners.size());
    for (const std::uint32_t row : order) rows.Append(Lead(row), Rest(row), owners[row]);
    return rows;
  }
};

KeyRows MakeRows(const ContextTable& table, const PrincipalAxes& axes) {
  KeyRows rows;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::vector<float> key_m = PaddedKey(axes, table.retrieval_key_cm(i));
    rows.rest_size = key_m.size() - kNumLead;
    const ContextTable::Entry& entry = table.entry(i);
    rows.Append(key_m.data(), key_m.data() + kNumLead,
                {static_cast<std::uint32_t>(i), entry.place, entry.augmented});
  }
  return rows;
}

/// Squared L2 distance over the leading components, for nanoflann.
struct LeadDistance {
  using ElementType = float;
  using DistanceType = float;

  explicit LeadDistance(const KeyRows& rows_in) : rows(rows_in) {}

  // NOLINTNEXTLINE(readability-identifier-naming): nanoflann calls it so.
  [[nodiscard]] float evalMetric(const float* key_m, std::uint32_t row, std::size_t) const {
    static_assert(kNumLead == 2 * kBlockSize);
    const float* lead_m = rows.Lead(row);
    return Sum(SquaredDifference(key_m, lead_m) +
               SquaredDifference(key_m + kBlockSize, lead_m + kBlockSize));
  }
  // NOLINTNEXTLINE(readability-identifier-naming): nanoflann calls it so.
  [[nodiscard]] float accum_dist(float a, float b, std::size_t) const { return (a - b) * (a - b); }

  const KeyRows& rows;
};

/// The k nearest places, one entry a place, for nanoflann to fill.
///
/// Ordered by (distance, entry), so that the result does not depend on the order in which the tree
/// is walked, nor on its shape.
class NearestPlaces {
 public:
  using DistanceType = float;

  NearestPlaces(const KeyRows& rows, const std::vector<float>& key_m, std::size_t k, bool augmented,
                const std::vector<bool>* excluded)
      : rows_(rows),
        key_rest_m_(key_m.data() + kNumLead),
        k_(k),
        augmented_(augmented),
        excluded_(excluded) {
    found_.reserve(k + 1);
  }

  [[nodiscard]] std::size_t size() const { return found_.size(); }
  [[nodiscard]] bool full() const { return found_.size() == k_; }
  // nanoflann passes over what is not nearer than this.
  // NOLINTNEXTLINE(readability-identifier-naming): nanoflann calls it so.
  [[nodiscard]] float worstDist() const { return reach_; }

  // `lead_distance` is at most the distance, so nothing near enough is ever passed over.
  // NOLINTNEXTLINE(readability-identifier-naming): nanoflann calls it so.
  bool addPoint(float lead_distance, std::uint32_t row) {
    const float distance = lead_distance + RestDistance(row);
    if (distance >= reach_) return true;
    const KeyRows::Owner& owner = rows_.owners[row];
    if (!augmented_ && owner.augmented) return true;
    const Found candidate{distance, owner.entry, owner.place};
    if (full() && !(candidate < found_.back())) return true;
    if (excluded_ != nullptr && (*excluded_)[static_cast<std::size_t>(owner.place)]) return true;
    Insert(candidate);
    return true;
  }

  [[nodiscard]] std::vector<KeyIndex::Neighbor> Neighbors() const {
    std::vector<KeyIndex::Neighbor> neighbors;
    neighbors.reserve(found_.size());
    for (const Found& f : found_) neighbors.push_back({f.entry, std::sqrt(double{f.distance})});
    return neighbors;
  }

 private:
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();

  struct Found {
    float distance;  // squared
    std::uint32_t entry;
    std::int32_t place;
    bool operator<(const Found& other) const {
      return distance != other.distance ? distance < other.distance : entry < other.entry;
    }
  };

  [[nodiscard]] float RestDistance(std::uint32_t row) const {
    const float* rest_m = rows_.Rest(row);
    Block sums = Block::Zero();
    for (std::size_t i = 0; i < rows_.rest_size; i += kBlockSize) {
      sums += SquaredDifference(key_rest_m_ + i, rest_m + i);
    }
    return Sum(sums);
  }

  void Insert(const Found& candidate) {
    const auto same = std::find_if(found_.begin(), found_.end(),
                                   [&](const Found& f) { return f.place == candidate.place; });
    if (same != found_.end()) {
      if (!(candidate < *same)) return;
      found_.erase(same);
    } else if (full()) {
      found_.pop_back();
    }
    found_.insert(std::upper_bound(found_.begin(), found_.end(), candidate), candidate);
    if (full()) {
      // Ties are let in, and what nanoflann's rounding on the way to a branch might cost.
      constexpr float kSlack = 1.00001F;
      reach_ = std::nextafter(found_.back().distance * kSlack, kInfinity);
    }
  }

  const KeyRows& rows_;
  const float* key_rest_m_;
  std::size_t k_;
  bool augmented_;
  const std::vector<bool>* excluded_;
  float reach_ = kInfinity;
  std::vector<Found> found_;
};

}  // namespace

struct KeyIndex::Tree {
  using Index = nanoflann::KDTreeSingleIndexAdaptor<LeadDistance, KeyRows, kNumLead, std::uint32_t>;

  Tree(const ContextTable& table, KeyScale scale)
      : axes(table, scale),
        rows(MakeRows(table, axes)),
        index(kNumLead, rows, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafSize)) {
    // The tree knows its points by their places in vAcc. From here on rows are in that order, so
    // that those of a leaf follow each other.
    rows = rows.InOrder(index.vAcc);
    std::iota(index.vAcc.begin(), index.vAcc.end(), 0U);
  }

  PrincipalAxes axes;
  KeyRows rows;
  Index index;
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
  tree_->index.findNeighbors(nearest, key_m.data(), nanoflann::SearchParams());
  return nearest.Neighbors();
}

}  // namespace scanloc
