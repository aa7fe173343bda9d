#include "scanloc/core/scan_context/match.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include "absl/container/inlined_vector.h"
#include "scan/simd.hpp"

namespace scanloc {
namespace {

/// Exact inner products of two columns.
struct Products {
  std::int64_t query_place = 0;
  std::int64_t query_query = 0;
  std::int64_t place_place = 0;
};

// The products of so many rows fit into 32 bits: 32 · 8191² < 2³¹.
constexpr int kRowsPerChunk = 32;
static_assert(std::int64_t{kRowsPerChunk} * Context::kMaxHeight_cm * Context::kMaxHeight_cm <=
              std::numeric_limits<std::int32_t>::max());

inline Products Multiply(const std::uint16_t* query, const std::uint16_t* place, int num_rows) {
  Products total;
  for (int begin = 0; begin < num_rows; begin += kRowsPerChunk) {
    const int end = std::min(begin + kRowsPerChunk, num_rows);
    std::int32_t qp = 0;
    std::int32_t qq = 0;
    std::int32_t pp = 0;
    for (int r = begin; r < end; ++r) {
      // Heights fit into 15 bits, and signed 16-bit factors are what SIMD multiplies in pairs.
      const auto q = static_cast<std::int16_t>(query[r]);
      const auto p = static_cast<std::int16_t>(place[r]);
      qp += q * p;
      qq += q * q;
      pp += p * p;
    }
    total.query_place += qp;
    total.query_query += qq;
    total.place_place += pp;
  }
  return total;
}

/// The map columns that some query column lies on, [first, last), and how many places to the left
/// that query column is, in up to two runs (a circular shift wraps round once).
struct ColumnRun {
  int first = 0;
  int last = 0;
  int query_offset = 0;  // query column = map column + query_offset
};

struct ColumnRuns {
  ColumnRun runs[2];
};

ColumnRuns ShiftedRuns(int num_cols, int shift, ShiftMode mode) {
  if (mode == ShiftMode::kBounded) {
    return {{{std::max(0, shift), std::min(num_cols, num_cols + shift), -shift}, {}}};
  }
  const int n = ((shift % num_cols) + num_cols) % num_cols;
  return {{{n, num_cols, -n}, {0, n, num_cols - n}}};
}

/// The sum of 1 - cosine over the columns of a run that at least one side has, and their number.
struct ColumnSum {
  double sum = 0.0;
  int num_columns = 0;
};

SCANLOC_SIMD void AddRun(const ContextView& query, const ContextView& place, const ColumnRun& run,
                         ColumnSum& total) {
  const int num_rows = place.num_rows;
  for (int j = run.first; j < run.last; ++j) {
    const std::ptrdiff_t query_begin = std::ptrdiff_t{j + run.query_offset} * num_rows;
    const Products products =
        Multiply(query.cells_cm.data() + query_begin,
                 place.cells_cm.data() + std::ptrdiff_t{j} * num_rows, num_rows);
    if (products.query_query == 0 && products.place_place == 0) continue;
    ++total.num_columns;
    if (products.query_query == 0 || products.place_place == 0) {
      total.sum += 1.0;
      continue;
    }
    const double norms = std::sqrt(static_cast<double>(products.query_query)) *
                         std::sqrt(static_cast<double>(products.place_place));
    total.sum += std::max(0.0, 1.0 - static_cast<double>(products.query_place) / norms);
  }
}

/// The shift of first ... last with the least squared difference of the keys, the first of equal
/// ones. The query's key goes on to both sides by as many columns as it is shifted.
SCANLOC_SIMD int BestKeyShift(const std::int32_t* query, const std::int32_t* place, int num_cols,
                              int first, int last) {
  int best_shift = first;
  std::int64_t best = std::numeric_limits<std::int64_t>::max();
  for (int shift = first; shift <= last; ++shift) {
    const std::int32_t* shifted = query - shift;
    std::int64_t total = 0;
    for (int j = 0; j < num_cols; ++j) {
      // Keys are not negative, so that their difference has as many bits.
      const std::int32_t difference = place[j] - shifted[j];
      total += std::int64_t{difference} * difference;
    }
    if (total < best) {
      best = total;
      best_shift = shift;
    }
  }
  return best_shift;
}

/// First and last shift that the options allow.
std::pair<int, int> ShiftRange(const ContextView& place, const AlignOptions& options) {
  if (options.shift_mode == ShiftMode::kCircular) return {0, place.num_cols - 1};
  return {-options.max_shift, options.max_shift};
}

/// The best of the shifts first ... last by full descriptor; equal ones: the first.
Match BestShift(const ContextView& query, const ContextView& place, int first, int last,
                ShiftMode mode) {
  Match best{first, ShiftedDistance(query, place, first, mode)};
  for (int shift = first + 1; shift <= last; ++shift) {
    const double distance = ShiftedDistance(query, place, shift, mode);
    if (distance < best.distance) best = {shift, distance};
  }
  return best;
}

}  // namespace

AlignOptions AlignOptionsOf(const Params& params, DescriptorKind kind) {
  if (kind == DescriptorKind::kPolar) {
    return {ShiftMode::kCircular, 0, params.search.align_radius};
  }
  return {params.cart.shift_mode, params.cart.max_shift_cols, params.search.align_radius};
}

double ShiftedDistance(const ContextView& query, const ContextView& place, int shift,
                       ShiftMode mode) {
  ColumnSum total;
  const ColumnRuns shifted = ShiftedRuns(place.num_cols, shift, mode);
  for (const ColumnRun& run : shifted.runs) AddRun(query, place, run, total);
  if (mode == ShiftMode::kBounded) {
    // Map columns outside the run face nothing.
    const ColumnRun& run = shifted.runs[0];
    for (int j = 0; j < place.num_cols; ++j) {
      if ((j < run.first || j >= run.last) && place.aligning_cm[j] != 0) {
        ++total.num_columns;
        total.sum += 1.0;
      }
    }
  }
  return total.num_columns == 0 ? 1.0 : total.sum / total.num_columns;
}

int PreAlign(const ContextView& query, const ContextView& place, const AlignOptions& options) {
  const auto [first, last] = ShiftRange(place, options);
  // Round in a circle, or bare ground on either side: what no query column lies on is compared
  // with 0.
  const std::span<const std::int32_t> key = query.aligning_cm;
  absl::InlinedVector<std::int32_t, 192> endless(3 * key.size(), 0);
  for (const std::size_t turn : {0, 1, 2}) {
    if (turn != 1 && options.shift_mode == ShiftMode::kBounded) continue;
    std::copy(key.begin(), key.end(),
              endless.begin() + static_cast<std::ptrdiff_t>(turn * key.size()));
  }
  return BestKeyShift(endless.data() + key.size(), place.aligning_cm.data(), place.num_cols, first,
                      last);
}

Match AlignByKey(const ContextView& query, const ContextView& place, const AlignOptions& options) {
  const int shift = PreAlign(query, place, options);
  int first = shift - options.radius;
  int last = shift + options.radius;
  if (options.shift_mode == ShiftMode::kCircular) {
    last = std::min(last, first + place.num_cols - 1);
    Match match = BestShift(query, place, first, last, options.shift_mode);
    match.shift = ((match.shift % place.num_cols) + place.num_cols) % place.num_cols;
    return match;
  }
  first = std::max(first, -options.max_shift);
  last = std::min(last, options.max_shift);
  return BestShift(query, place, first, last, options.shift_mode);
}

Match AlignNaively(const ContextView& query, const ContextView& place,
                   const AlignOptions& options) {
  const auto [first, last] = ShiftRange(place, options);
  return BestShift(query, place, first, last, options.shift_mode);
}

}  // namespace scanloc
