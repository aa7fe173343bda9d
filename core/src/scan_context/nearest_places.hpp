#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/scan_context/key_index.hpp"

namespace scanloc {

/// Squared distance of keys from one, of whole centimetres: the same bits whatever tree they are
/// held in.
class KeyDistance {
  static auto Of(std::span<const std::int32_t> key_cm) {
    const auto size = static_cast<Eigen::Index>(key_cm.size());
    return Eigen::Map<const Eigen::VectorXi>(key_cm.data(), size).cast<double>();
  }

 public:
  KeyDistance(KeyScale scale, std::span<const std::int32_t> key_cm)
      : scale_(scale), key_cm_(Of(key_cm)), square_cm2_(key_cm_.squaredNorm()) {}

  [[nodiscard]] double Squared(std::span<const std::int32_t> other) const {
    const auto other_cm = Of(other);
    // Sums of whole numbers below 2^53, so exact.
    if (scale_ == KeyScale::kMetres) return (key_cm_ - other_cm).squaredNorm() * 1e-4;
    const double other_cm2 = other_cm.squaredNorm();
    // A key of zeros has no direction, and stays what it is.
    if (square_cm2_ == 0.0 || other_cm2 == 0.0) return square_cm2_ == other_cm2 ? 0.0 : 1.0;
    return std::max(0.0, 2.0 - 2.0 * key_cm_.dot(other_cm) / std::sqrt(square_cm2_ * other_cm2));
  }

 private:
  KeyScale scale_;
  Eigen::VectorXd key_cm_;
  double square_cm2_;
};

/// The k nearest places, one entry a place.
///
/// Ordered by (distance, entry), so that the result does not depend on the order in which the trees
/// are walked, nor on their shapes.
class NearestPlaces {
 public:
  NearestPlaces(const ContextTable& table, const KeyDistance& distance, std::size_t k,
                bool augmented, const std::vector<bool>* excluded)
      : table_(table), distance_(distance), k_(k), augmented_(augmented), excluded_(excluded) {
    found_.reserve(k + 1);
    key_cm_.resize(static_cast<std::size_t>(table.num_rows()));
  }

  /// Squared; nothing beyond is of interest.
  [[nodiscard]] double reach() const {
    return found_.size() < k_ ? std::numeric_limits<double>::infinity() : found_.back().distance;
  }

  [[nodiscard]] bool takes_augmented() const { return augmented_; }

  /// Whether that changed anything.
  bool Add(std::uint32_t entry) {
    const ContextTable::Entry owner = table_.entry(entry);
    if (!augmented_ && owner.augmented) return false;
    table_.ReadRetrievalKey(entry, key_cm_);
    const Found candidate{distance_.Squared(key_cm_), entry, owner.place};
    if (found_.size() == k_ && !(candidate < found_.back())) return false;
    if (excluded_ != nullptr && (*excluded_)[static_cast<std::size_t>(owner.place)]) return false;
    const auto same = std::find_if(found_.begin(), found_.end(),
                                   [&](const Found& f) { return f.place == candidate.place; });
    if (same != found_.end()) {
      if (!(candidate < *same)) return false;
      found_.erase(same);
    } else if (found_.size() == k_) {
      found_.pop_back();
    }
    found_.insert(std::upper_bound(found_.begin(), found_.end(), candidate), candidate);
    return true;
  }

  [[nodiscard]] std::vector<KeyIndex::Neighbor> Neighbors() const {
    std::vector<KeyIndex::Neighbor> neighbors;
    neighbors.reserve(found_.size());
    for (const Found& f : found_) neighbors.push_back({f.entry, std::sqrt(f.distance)});
    return neighbors;
  }

 private:
  struct Found {
    double distance;  // squared
    std::uint32_t entry;
    std::int32_t place;
    bool operator<(const Found& other) const {
      return distance != other.distance ? distance < other.distance : entry < other.entry;
    }
  };

  const ContextTable& table_;
  const KeyDistance& distance_;
  std::size_t k_;
  bool augmented_;
  const std::vector<bool>* excluded_;
  std::vector<Found> found_;
  std::vector<std::int32_t> key_cm_;
};

}  // namespace scanloc
