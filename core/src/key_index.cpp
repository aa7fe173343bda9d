#include "scanloc/core/key_index.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

namespace scanloc {
namespace {

/// Components of a key that the tree looks at; the rest only adds to the distance of what it lets
/// through. The components are ordered by variance, and eight have nearly all of it.
constexpr int kMaxLead = 8;

/// Keys on their principal axes, parted into what the tree looks at and the rest.
struct KeyRows {
  int num_lead = 0;
  int num_rest = 0;
  std::vector<float> lead_m;
  std::vector<float> rest_m;
  std::vector<ContextTable::Entry> entries;

  // What nanoflann asks for.
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return entries.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t entry, std::size_t component) const {
    return lead_m[entry * static_cast<std::size_t>(num_lead) + component];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }

  void Append(const std::vector<float>& key_m, const ContextTable::Entry& entry) {
    lead_m.insert(lead_m.end(), key_m.begin(), key_m.begin() + num_lead);
    rest_m.insert(rest_m.end(), key_m.begin() + num_lead, key_m.end());
    entries.push_back(entry);
  }

  /// Squared distance over the rest of the components.
  [[nodiscard]] float RestDistance(std::uint32_t entry, const float* key_rest_m) const {
    const float* rest = rest_m.data() + std::size_t{entry} * static_cast<std::size_t>(num_rest);
    float sum = 0.0F;
    for (int i = 0; i < num_rest; ++i) {
      const float difference = rest[i] - key_rest_m[i];
      sum += difference * difference;
    }
    return sum;
  }
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
        key_rest_m_(key_m.data() + rows.num_lead),
        k_(k),
        augmented_(augmented),
        excluded_(excluded) {
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

  // `lead_distance` is at most the distance, so nothing near enough is ever passed over.
  // NOLINTNEXTLINE(readability-identifier-naming): nanoflann calls it so.
  bool addPoint(float lead_distance, std::uint32_t entry) {
    if (!augmented_ && rows_.entries[entry].augmented) return true;
    const Found candidate{lead_distance + rows_.RestDistance(entry, key_rest_m_), entry};
    if (full() && !(candidate < found_.back())) return true;
    const std::int32_t place = rows_.entries[entry].place;
    if (excluded_ != nullptr && (*excluded_)[static_cast<std::size_t>(place)]) return true;
    const auto same = std::find_if(found_.begin(), found_.end(), [&](const Found& f) {
      return rows_.entries[f.entry].place == place;
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
  const KeyRows& rows_;
  const float* key_rest_m_;
  std::size_t k_;
  bool augmented_;
  const std::vector<bool>* excluded_;
  std::vector<Found> found_;
};

constexpr std::size_t kLeafSize = 16;

/// Turns keys onto the principal axes of the map's keys, greatest variance first.
///
/// Distances stay as they are, but the rows of keys go up and down together: along these axes the
/// tree cuts where keys differ, and most distances are known to be too great after a few terms.
class PrincipalAxes {
 public:
  PrincipalAxes(const ContextTable& table, KeyScale scale) : scale_(scale) {
    const int num_rows = table.num_rows();
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(num_rows);
    Eigen::MatrixXd second_moment = Eigen::MatrixXd::Zero(num_rows, num_rows);
    for (std::size_t i = 0; i < table.size(); ++i) {
      const Eigen::VectorXd key_m = Scaled(table.retrieval_key_cm(i));
      mean += key_m;
      second_moment.selfadjointView<Eigen::Lower>().rankUpdate(key_m);
    }
    const double count = std::max<double>(1.0, static_cast<double>(table.size()));
    mean /= count;
    second_moment.triangularView<Eigen::Lower>() -= (count * mean * mean.transpose()).eval();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(second_moment);
    axes_ = solver.eigenvectors().rowwise().reverse().transpose();
  }

  [[nodiscard]] std::vector<float> Turn(std::span<const std::int32_t> key_cm) const {
    const Eigen::VectorXf turned = (axes_ * Scaled(key_cm)).cast<float>();
    return {turned.begin(), turned.end()};
  }

 private:
  [[nodiscard]] Eigen::VectorXd Scaled(std::span<const std::int32_t> key_cm) const {
    const Eigen::Map<const Eigen::VectorXi> key(key_cm.data(),
                                                static_cast<Eigen::Index>(key_cm.size()));
    const Eigen::VectorXd key_m = key.cast<double>() * 0.01;
    return scale_ == KeyScale::kUnit ? Eigen::VectorXd(key_m.normalized()) : key_m;
  }

  KeyScale scale_;
  Eigen::MatrixXd axes_;  // one a row
};

}  // namespace

struct KeyIndex::Tree {
  using Index = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Adaptor<float, KeyRows>, KeyRows,
                                                    -1, std::uint32_t>;

  Tree(PrincipalAxes axes_in, KeyRows rows_in)
      : axes(std::move(axes_in)),
        rows(std::move(rows_in)),
        index(rows.num_lead, rows, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafSize)) {}

  PrincipalAxes axes;
  KeyRows rows;
  Index index;
};

KeyIndex::KeyIndex(const ContextTable& table, KeyScale scale) {
  PrincipalAxes axes(table, scale);
  KeyRows rows;
  rows.num_lead = std::min(kMaxLead, table.num_rows());
  rows.num_rest = table.num_rows() - rows.num_lead;
  for (std::size_t i = 0; i < table.size(); ++i) {
    rows.Append(axes.Turn(table.retrieval_key_cm(i)), table.entry(i));
  }
  tree_ = std::make_unique<Tree>(std::move(axes), std::move(rows));
}

KeyIndex::KeyIndex(KeyIndex&&) noexcept = default;
KeyIndex& KeyIndex::operator=(KeyIndex&&) noexcept = default;
KeyIndex::~KeyIndex() = default;

std::vector<KeyIndex::Neighbor> KeyIndex::Search(std::span<const std::int32_t> retrieval_cm, int k,
                                                 bool augmented,
                                                 const std::vector<bool>* excluded) const {
  if (k <= 0 || tree_->rows.entries.empty()) return {};
  const std::vector<float> key_m = tree_->axes.Turn(retrieval_cm);
  NearestPlaces nearest(tree_->rows, key_m, static_cast<std::size_t>(k), augmented, excluded);
  tree_->index.findNeighbors(nearest, key_m.data(), nanoflann::SearchParams());
  return nearest.Neighbors();
}

}  // namespace scanloc
