#include "structural/signature_rows.hpp"

#include <algorithm>
#include <limits>

#include "scan/prefetch.hpp"

#ifdef __x86_64__
#include <immintrin.h>
#endif

namespace scanloc {
namespace {

constexpr std::size_t kNumLanes = SignatureRows::kNumLanes;
constexpr std::size_t kPairSize = 2 * kNumLanes;

/// Held numbers are not negative; products of two pairs of them then fit into 16 bits, and so does
/// what all add up to, whatever overflows on the way.
constexpr int kZero = 64;

}  // namespace

namespace signature_rows {
namespace {

void ComparePortable(const std::uint8_t* batch, const SignatureQuery& query,
                     SignatureScores& scores) {
  scores = {};
  for (const SignatureQuery::Rows& part : query.parts()) {
    const std::int8_t* row = part.pairs.data();
    std::int32_t best[kNumLanes];
    std::fill_n(best, kNumLanes, std::numeric_limits<std::int32_t>::min());
    for (std::size_t r = 0; r < part.biases.size(); ++r) {
      std::int32_t sums[kNumLanes] = {};
      const std::uint8_t* of_batch = batch + part.first_pair * kPairSize;
      for (std::size_t p = 0; p < part.num_pairs; ++p, of_batch += kPairSize, row += kPairSize) {
        for (std::size_t lane = 0; lane < kNumLanes; ++lane) {
          sums[lane] += (of_batch[2 * lane] - kZero) * row[2 * lane] +
                        (of_batch[2 * lane + 1] - kZero) * row[2 * lane + 1];
        }
      }
      for (std::size_t lane = 0; lane < kNumLanes; ++lane) {
        if (sums[lane] <= best[lane]) continue;
        best[lane] = sums[lane];
        if (&part == query.parts().data()) scores.row[lane] = static_cast<std::int16_t>(r);
      }
    }
    for (std::size_t lane = 0; lane < kNumLanes; ++lane) {
      scores.score[lane] = static_cast<std::int16_t>(scores.score[lane] + best[lane]);
    }
  }
}

#ifdef __x86_64__

/// The best of the rows so far, lane by lane, and which it is.
struct Best {
  __m256i score;
  __m256i row;
};

/// Adds some rows.
template <std::size_t kNumRows>
__attribute__((target("avx2"))) void AddRows(const std::uint8_t* of_batch,
                                             const SignatureQuery::Rows& part, std::size_t first,
                                             Best& best) {
  const std::size_t row_size = part.num_pairs * kPairSize;
  const std::int8_t* const rows = part.pairs.data() + first * row_size;
  __m256i sums[kNumRows];
  for (std::size_t r = 0; r < kNumRows; ++r) sums[r] = _mm256_set1_epi16(part.biases[first + r]);
  for (std::size_t p = 0; p < row_size; p += kPairSize) {
    const __m256i pair = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(of_batch + p));
    for (std::size_t r = 0; r < kNumRows; ++r) {
      const __m256i row =
          _mm256_loadu_si256(reinterpret_cast<const __m256i*>(rows + r * row_size + p));
      sums[r] = _mm256_add_epi16(sums[r], _mm256_maddubs_epi16(pair, row));
    }
  }
  for (std::size_t r = 0; r < kNumRows; ++r) {
    const __m256i number = _mm256_set1_epi16(static_cast<std::int16_t>(first + r));
    const __m256i is_better = _mm256_cmpgt_epi16(sums[r], best.score);
    best.row = _mm256_blendv_epi8(best.row, number, is_better);
    best.score = _mm256_max_epi16(best.score, sums[r]);
  }
}

__attribute__((target("avx2"))) void CompareAvx2(const std::uint8_t* batch,
                                                 const SignatureQuery& query,
                                                 SignatureScores& scores) {
  constexpr std::size_t kAtOnce = 5;
  __m256i added = _mm256_setzero_si256();
  for (const SignatureQuery::Rows& part : query.parts()) {
    const std::uint8_t* const of_batch = batch + part.first_pair * kPairSize;
    const std::size_t num_rows = part.biases.size();
    Best best{_mm256_set1_epi16(std::numeric_limits<std::int16_t>::min()), _mm256_setzero_si256()};
    std::size_t row = 0;
    for (; row + kAtOnce <= num_rows; row += kAtOnce) AddRows<kAtOnce>(of_batch, part, row, best);
    for (; row < num_rows; ++row) AddRows<1>(of_batch, part, row, best);
    added = _mm256_add_epi16(added, best.score);
    if (&part == query.parts().data()) {
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(scores.row.data()), best.row);
    }
  }
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(scores.score.data()), added);
}

#endif

}  // namespace

const std::vector<NamedKernel>& Kernels() {
  static const std::vector<NamedKernel> kKernels = [] {
    std::vector<NamedKernel> kernels;
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx2")) kernels.push_back({"avx2", &CompareAvx2});
#endif
    kernels.push_back({"portable", &ComparePortable});
    return kernels;
  }();
  return kKernels;
}

}  // namespace signature_rows

void SignatureQuery::Add(const SignatureShape::Part& part, std::span<const std::int8_t> row) {
  if (part.size == 0) return;
  const std::size_t first_pair = part.begin / 2;
  if (parts_.empty() || parts_.back().first_pair != first_pair) {
    parts_.push_back({first_pair, part.size / 2, {}, {}});
  }
  Rows& rows = parts_.back();
  int sum = 0;
  for (std::size_t i = 0; i < part.size; i += 2) {
    sum += row[i] + row[i + 1];
    for (std::size_t lane = 0; lane < kNumLanes; ++lane) {
      rows.pairs.insert(rows.pairs.end(), {row[i], row[i + 1]});
    }
  }
  rows.biases.push_back(static_cast<std::int16_t>(-kZero * sum));
}

void SignatureRows::Set(std::size_t i, std::span<const std::int8_t> signature) {
  size_ = signature.size();
  const std::size_t batch = i / kNumLanes;
  if (batch == num_batches()) {
    bytes_.resize(bytes_.size() + batch_size(), static_cast<std::uint8_t>(kZero));
  }
  std::uint8_t* lane = bytes_.data() + batch * batch_size() + 2 * (i % kNumLanes);
  for (std::size_t c = 0; c < size_; c += 2, lane += kPairSize) {
    lane[0] = static_cast<std::uint8_t>(signature[c] + kZero);
    lane[1] = static_cast<std::uint8_t>(signature[c + 1] + kZero);
  }
}

void SignatureRows::Prefetch(std::size_t batch) const {
  scanloc::Prefetch(bytes_.data() + batch * batch_size(), batch_size());
}

void SignatureRows::Compare(std::size_t batch, const SignatureQuery& query, SignatureScores& scores,
                            signature_rows::Kernel kernel) const {
  kernel(bytes_.data() + batch * batch_size(), query, scores);
}

}  // namespace scanloc
