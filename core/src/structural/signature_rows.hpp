#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "structural/signature.hpp"

namespace scanloc {

/// A query's signatures, made ready to be compared with those of many places.
class SignatureQuery {
 public:
  /// What is compared with one part of a signature: several rows, the best of which counts.
  struct Rows {
    std::size_t first_pair = 0;
    std::size_t num_pairs = 0;
    std::vector<std::int8_t> pairs;    // row by row, each pair as often as a batch has lanes
    std::vector<std::int16_t> biases;  // of each row, for how places are held
  };

  /// Scales of a part and its row, in all, at most 2^14.
  void Add(const SignatureShape::Part& part, std::span<const std::int8_t> row);

  [[nodiscard]] const std::vector<Rows>& parts() const { return parts_; }

 private:
  std::vector<Rows> parts_;
};

/// What some places side by side have of a query.
struct SignatureScores {
  static constexpr std::size_t kNumLanes = 16;
  std::array<std::int16_t, kNumLanes> score{};
  std::array<std::int16_t, kNumLanes> row{};  ///< of the first part: the best, the first of equals
};

namespace signature_rows {

/// Compares a batch as SignatureRows::Compare does.
using Kernel = void (*)(const std::uint8_t* batch, const SignatureQuery& query,
                        SignatureScores& scores);
struct NamedKernel {
  const char* name;
  Kernel kernel;
};
/// Those that the processor has, the fastest first; all tell the same.
[[nodiscard]] const std::vector<NamedKernel>& Kernels();

}  // namespace signature_rows

/// Signatures of places, of scale kScale, sixteen side by side: a processor compares them at once.
class SignatureRows {
 public:
  static constexpr std::size_t kNumLanes = SignatureScores::kNumLanes;
  static constexpr double kScale = 63.0;

  /// Sets a signature: the one behind the last, or one before. Requires that all have one size.
  void Set(std::size_t i, std::span<const std::int8_t> signature);

  [[nodiscard]] std::size_t num_batches() const {
    return bytes_.empty() ? 0 : bytes_.size() / batch_size();
  }

  /// How much of a query each signature of a batch has; 0 of lanes that were not set.
  void Compare(std::size_t batch, const SignatureQuery& query, SignatureScores& scores,
               signature_rows::Kernel kernel = signature_rows::Kernels()[0].kernel) const;

  /// The batch is compared soon.
  void Prefetch(std::size_t batch) const;

  friend bool operator==(const SignatureRows&, const SignatureRows&) = default;

 private:
  [[nodiscard]] std::size_t batch_size() const { return size_ * kNumLanes; }

  std::size_t size_ = 0;             // of a signature
  std::vector<std::uint8_t> bytes_;  // a pair of each lane, then the next pair
};

}  // namespace scanloc
