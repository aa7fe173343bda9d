#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace scanloc {
namespace key_batches {

/// What NearLanes does, of one batch: `pair` has num_pairs × lane × 2 components, num_pairs a
/// multiple of four. All kernels answer alike, bit for bit, sums of lanes that are near included.
using Kernel = std::uint32_t (*)(const std::int16_t* pair, const std::int16_t* of_query,
                                 std::size_t num_pairs, std::int32_t limit, std::int32_t* sums);

struct NamedKernel {
  const char* name;
  Kernel kernel;
};

/// Those that this processor can run, the fastest first.
[[nodiscard]] std::vector<NamedKernel> Kernels();

}  // namespace key_batches

/// Keys in 16 bits a component, sixteen keys side by side: tells at a fraction of a distance's cost
/// which of them cannot be nearer than some distance. Thread-safe once filled.
class KeyBatches {
 public:
  static constexpr std::size_t kNumLanes = 16;

  /// Squared distances in the batches' units, rounded as their components are; one a lane.
  using Sums = std::array<std::int32_t, kNumLanes>;

  /// A key to compare with, as the batches hold theirs.
  struct Query {
    std::vector<std::int16_t> components;
  };

  KeyBatches() = default;

  /// Will hold keys of `size` components in the range of those that lie one behind the other in
  /// `sample`; what lies outside is moved to its bound, which brings any two keys nearer.
  KeyBatches(std::span<const float> sample, std::size_t size);

  /// Components of a key as Quantize gives it.
  [[nodiscard]] std::size_t key_size() const { return 2 * num_pairs_; }

  /// Gives back the memory that was kept for more batches.
  void ShrinkToFit() { components_.shrink_to_fit(); }
  /// Appends a batch of at most kNumLanes keys, each of key_size() components; the lanes left over
  /// hold nothing.
  void Append(std::span<const std::int16_t* const> keys);
  void Reserve(std::size_t num_batches) { components_.reserve(num_batches * batch_size_); }

  [[nodiscard]] std::size_t num_batches() const {
    return batch_size_ == 0 ? 0 : components_.size() / batch_size_;
  }

  /// A key with as many components as the sample's.
  [[nodiscard]] Query Quantize(const float* key) const;
  /// The same into key_size() zeros.
  void Quantize(const float* key, std::span<std::int16_t> components) const;

  /// By how much the L2 distance of two keys may look greater than it is.
  [[nodiscard]] float slack() const {
    // Rounding moves either key by up to half a step a component; the difference is one step, and a
    // little for the arithmetic.
    return 1.01F * std::sqrt(static_cast<float>(size_)) / scale_;
  }
  /// The squared L2 distance that a sum tells.
  [[nodiscard]] float DistanceOf(std::int32_t sum) const {
    return static_cast<float>(static_cast<double>(sum) / (double{scale_} * double{scale_}));
  }
  /// What NearLanes wants for a squared L2 distance as sums tell it; infinity is fine.
  [[nodiscard]] std::int32_t LimitOf(float squared_distance) const;

  /// Bit i is set if the key of lane i may lie within the limit; lanes that hold nothing may have
  /// their bits set, too. Writes the sums of those whose bits are set.
  [[nodiscard]] std::uint32_t NearLanes(std::size_t batch, const Query& query, std::int32_t limit,
                                        Sums& sums) const;

 private:
  [[nodiscard]] std::int16_t Quantized(float value, std::size_t component) const;

  std::size_t size_ = 0;
  std::size_t num_pairs_ = 0;   // of components, padded with zeros
  std::size_t batch_size_ = 0;  // [components]
  std::int32_t max_ = 0;        // components lie in [-max_, max_]
  float scale_ = 1.0F;
  std::vector<float> centers_;
  std::vector<std::int16_t> components_;  // batch, pair, lane, component of the pair
};

}  // namespace scanloc
