#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "scan_context/key_distance.hpp"
#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/scan_context/key_index.hpp"

namespace scanloc {

/// The k nearest places, one entry a place.
///
/// Ordered by (distance, entry), so that the result does not depend on the order in which the trees
/// are walked, nor on their shapes.
class NearestPlaces {
 public:
  NearestPlaces(const ContextTable& table, const KeyDistance& distance, std::size_t k,
                bool augmented, const std::vector<bool>* excluded)
      : table_(table), distance_(distance), k_(k), augmented_(augmented), excluded_(excluded) {
    found_.reserve(k + Slack() + 1);
    slots_.reserve(k + Slack() + 1);
  }

  [[nodiscard]] std::size_t k() const { return k_; }

  /// Squared; nothing beyond is of interest.
  [[nodiscard]] double reach() const { return reach_; }

  [[nodiscard]] bool takes_augmented() const { return augmented_; }

  /// Will be added soon.
  void Prefetch(std::uint32_t entry) const { table_.Prefetch(entry); }

  /// Whether that has narrowed the reach.
  bool Add(std::uint32_t entry) {
    const ContextTable::Entry owner = table_.entry(entry);
    if (!augmented_ && owner.augmented) return false;
    const Found candidate{distance_.Squared(table_, entry), entry, owner.place};
    if (candidate.distance > reach_) return false;
    if (excluded_ != nullptr && (*excluded_)[static_cast<std::size_t>(owner.place)]) return false;
    const auto [slot, is_new] = slots_.try_emplace(candidate.place, found_.size());
    if (is_new) {
      found_.push_back(candidate);
    } else if (candidate < found_[slot->second]) {
      found_[slot->second] = candidate;
    } else {
      return false;
    }
    if (found_.size() < k_ + Slack()) return false;
    Narrow();
    return true;
  }

  /// Narrows the reach as far as what was added allows.
  void Narrow() {
    if (found_.size() < k_) return;
    if (found_.size() > k_) {
      std::nth_element(found_.begin(), found_.begin() + static_cast<std::ptrdiff_t>(k_ - 1),
                       found_.end());
      for (std::size_t i = k_; i < found_.size(); ++i) slots_.erase(found_[i].place);
      found_.resize(k_);
      for (std::size_t i = 0; i < k_; ++i) slots_[found_[i].place] = i;
    }
    reach_ = std::max_element(found_.begin(), found_.end())->distance;
  }

  [[nodiscard]] std::vector<KeyIndex::Neighbor> Neighbors() {
    Narrow();
    std::sort(found_.begin(), found_.end());
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

  /// How many more than asked for are kept until the worst are taken out together.
  [[nodiscard]] std::size_t Slack() const { return k_ / 2; }

  const ContextTable& table_;
  const KeyDistance& distance_;
  std::size_t k_;
  bool augmented_;
  const std::vector<bool>* excluded_;
  std::vector<Found> found_;                              // of each place the nearest entry
  absl::flat_hash_map<std::int32_t, std::size_t> slots_;  // of the places in it
  double reach_ = std::numeric_limits<double>::infinity();
};

}  // namespace scanloc
