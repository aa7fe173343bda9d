#include "scan_context/key_search.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

namespace scanloc {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// What single precision may cost a distance, of the lengths of the keys.
constexpr float kRounding = 1e-6F;

/// So many candidates are looked at, and compared, together at least.
constexpr std::size_t kLeastPatience = 16;

/// Candidates that are compared while the memory of another comes.
constexpr std::ptrdiff_t kCandidatesAhead = 8;

}  // namespace

KeySearch::KeySearch(std::span<const Part> parts, std::span<const std::int32_t> key_cm,
                     NearestPlaces& nearest)
    : patience_(std::max(kLeastPatience, 4 * nearest.k())), nearest_(nearest), limit_(kInfinity) {
  for (const Part& part : parts) {
    const KeyTree& tree = *part.tree;
    const float norms = Add(part, key_cm, 0) + tree.greatest_norm_;
    slack_ = std::max(slack_, tree.batches_.slack() + kRounding * norms);
    if (!tree.has_flips_ || !nearest.takes_augmented()) continue;
    // A key is as far from a reversed one as the reversed key from that.
    Add(part, std::vector<std::int32_t>(key_cm.rbegin(), key_cm.rend()), 1);
  }
  std::make_heap(leaves_.begin(), leaves_.end(), std::greater<>());
}

float KeySearch::Add(const Part& part, std::span<const std::int32_t> key_cm, std::uint32_t flip) {
  const KeyTree& tree = *part.tree;
  KeyTree::Turned turned = tree.TurnedKey(key_cm);
  const auto first_leaf = static_cast<std::uint32_t>(leaves_.size());
  for (const std::int32_t bound : tree.BoundsOf(turned.key)) {
    leaves_.push_back(
        {tree.batches_.DistanceOf(bound), static_cast<std::uint32_t>(leaves_.size())});
  }
  turned_.push_back({&part, std::move(turned.key), flip, first_leaf});
  return turned.norm;
}

void KeySearch::Run() {
  SetLimit();
  while (!leaves_.empty() && leaves_.front().distance <= limit_) {
    const std::uint32_t number = leaves_.front().what;
    const auto next = std::upper_bound(
        turned_.begin(), turned_.end(), number,
        [](std::uint32_t leaf, const Turned& turned) { return leaf < turned.first_leaf; });
    const Turned& turned = *std::prev(next);
    ScanLeaf(turned, turned.part->tree->leaves_[number - turned.first_leaf]);
    std::pop_heap(leaves_.begin(), leaves_.end(), std::greater<>());
    leaves_.pop_back();
  }
  Settle();
}

void KeySearch::SetLimit() {
  constexpr float kSlack = 1.00002F;
  const float reach = static_cast<float>(std::sqrt(nearest_.reach())) * kSlack + slack_;
  limit_ = reach * reach;
}

void KeySearch::ScanLeaf(const Turned& turned, const KeyTree::Leaf& leaf) {
  const KeyTree& tree = *turned.part->tree;
  const auto first_entry = static_cast<std::uint32_t>(turned.part->begin) + turned.flip;
  KeyBatches::Sums sums;
  std::int32_t limit = tree.batches_.LimitOf(limit_);
  for (std::size_t i = 0; i < leaf.num_batches; ++i) {
    const std::size_t batch = leaf.first_batch + i;
    std::uint32_t near = tree.batches_.NearLanes(batch, turned.key, limit, sums);
    for (; near != 0; near &= near - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(near));
      const std::uint32_t owner = tree.owners_[batch * KeyBatches::kNumLanes + lane];
      if (owner == KeyTree::kNobody) continue;
      candidates_.push_back({tree.batches_.DistanceOf(sums[lane]), owner + first_entry});
    }
    if (candidates_.size() < patience_) continue;
    Settle();
    limit = tree.batches_.LimitOf(limit_);
  }
}

void KeySearch::Settle() {
  // Nearest first, some at a time: how far these are passes over most of the others.
  const auto num_at_once = static_cast<std::ptrdiff_t>(std::max(kLeastPatience, nearest_.k()));
  auto begin = candidates_.begin();
  auto end = candidates_.end();
  while (begin != end) {
    const auto next = begin + std::min(num_at_once, end - begin);
    if (next != end) std::nth_element(begin, next, end);
    for (; begin != next; ++begin) {
      if (next - begin > kCandidatesAhead) nearest_.Prefetch(begin[kCandidatesAhead].what);
      if (begin->distance <= limit_ && nearest_.Add(begin->what)) SetLimit();
    }
    nearest_.Narrow();
    SetLimit();
    end = std::partition(begin, end,
                         [this](const Ranked& farther) { return farther.distance <= limit_; });
  }
  candidates_.clear();
}

}  // namespace scanloc
