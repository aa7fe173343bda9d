#pragma once

#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/params.hpp"

namespace scanloc {

/// The bounds of alignment for one descriptor kind.
struct AlignOptions {
  ShiftMode shift_mode = ShiftMode::kCircular;
  int max_shift = 0;  ///< kBounded: shifts in [-max_shift, max_shift]; kCircular: all are tried
  int radius = 0;     ///< N(n̂*): the pre-aligned shift ± radius
};

/// Those that a map's parameters ask for.
[[nodiscard]] AlignOptions AlignOptionsOf(const Params& params, DescriptorKind kind);

/// How well a query's context lies on a map's.
struct Match {
  int shift = 0;  ///< n: query column j lies on map column j + n; see AlignOptions for its range
  double distance = 1.0;  ///< D, eq. minImgDist, in [0, 1]
};

/// Distance of two contexts of equal shape with the query's columns shifted by `shift` (eq.
/// imgDist).
///
/// The mean of 1 - cosine over the columns that at least one side has; a column that only one side
/// has counts 1, one that neither has says nothing and is left out. No column at all: 1. Bounded,
/// the map's columns are what is compared: one that no query column lies on faces nothing, while a
/// query column that was shifted out says nothing. So query and place cannot be exchanged.
[[nodiscard]] double ShiftedDistance(const ContextView& query, const ContextView& place, int shift,
                                     ShiftMode mode);

/// The shift that lays the aligning keys best on each other, by L2 (eq. prealign1).
[[nodiscard]] int PreAlign(const ContextView& query, const ContextView& place,
                           const AlignOptions& options);

/// Pre-alignment, then the full descriptors in the shift's neighbourhood (eq. prealign2).
[[nodiscard]] Match AlignByKey(const ContextView& query, const ContextView& place,
                               const AlignOptions& options);

/// The full descriptors over every shift that the options allow (eq. minImgDist).
[[nodiscard]] Match AlignNaively(const ContextView& query, const ContextView& place,
                                 const AlignOptions& options);

}  // namespace scanloc
