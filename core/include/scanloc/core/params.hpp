#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "scanloc/core/auto_fields.hpp"

namespace scanloc {

/// How the columns of one context are laid over another's (docs/algorithm.md, "Shifting columns").
enum class ShiftMode : std::uint8_t {  // persisted, never renumber
  kCircular = 0,                       ///< columns pushed out on one side come in on the other
  kBounded = 1,                        ///< columns pushed out are lost, empty ones come in
};

/// The polar context, PC (paper, Sec. IV-D1 and tab:impl).
struct PolarParams {
  bool enabled = true;
  int num_rings = 20;    ///< rows, N_R
  int num_sectors = 60;  ///< columns, N_A; even, so that half a turn is a whole number of sectors
  double max_range_m = 80.0;
  /// Root shifts of A-PC (paper, Sec. V-D1): lateral positions of the virtual vehicles, +y is left
  /// [m]. Empty: no augmentation.
  std::vector<double> root_shifts_m = {2.0, -2.0};

  friend bool operator==(const PolarParams&, const PolarParams&) = default;
};

/// The cart context, CC (paper, Sec. IV-D2 and tab:impl).
struct CartParams {
  bool enabled = true;
  int num_rows = 40;  ///< along x over ±max_x_m, N_R; even, so that no bin straddles zero
  int num_cols = 40;  ///< along y over ±max_y_m, N_A; even
  double max_x_m = 100.0;
  double max_y_m = 40.0;
  bool double_flip = true;  ///< A-CC (paper, Sec. V-D2): also hold the place as seen when reversed
  ShiftMode shift_mode = ShiftMode::kBounded;
  int max_shift_cols = 10;  ///< farthest lateral shift that is tried; kBounded only

  friend bool operator==(const CartParams&, const CartParams&) = default;
};

/// The upright structure of each scan, for geometric verification: what the method `auto` needs
/// beside the contexts (docs/algorithm.md, "Beyond the paper").
struct StructureParams {
  bool enabled = true;

  friend bool operator==(const StructureParams&, const StructureParams&) = default;
};

/// How a query is answered unless it asks otherwise (paper, Sec. V-A to V-C).
struct SearchParams {
  int num_candidates = 1;  ///< k, places taken from the tree
  int align_radius = 0;    ///< N(n̂*) holds the pre-aligned shift ± this many columns
  /// Acceptance thresholds τ of eq. LoopFound, a distance in [0, 1].
  double polar_threshold = 0.35;
  double cart_threshold = 0.35;
  /// Of the method `auto`: the least confidence, in (0, 1), at which an answer is `localized`.
  double min_confidence = 0.8;
  /// A scan with fewer voxels inside the region of interest is not looked up: insufficient_scan.
  int min_voxels = 50;

  friend bool operator==(const SearchParams&, const SearchParams&) = default;
};

/// The parameters of a map: set when it is built, stored in it, and read back by whoever queries
/// it. The defaults are the paper's table "Implementation details" (tab:impl).
struct Params {
  double voxel_size_m = 0.5;
  /// Added to every z, so that heights are above ground.
  double sensor_height_m = 2.0;
  PolarParams polar;
  CartParams cart;
  StructureParams structure;
  SearchParams search;
  AutoParams automatic;

  friend bool operator==(const Params&, const Params&) = default;
};

/// OK, or InvalidArgument that names the first bad field, its value and the allowed range.
[[nodiscard]] absl::Status Validate(const Params& params);

/// What a query's descriptors must have been made with to be comparable with a map's: a line of
/// text that is equal exactly when all parameters that shape a query's descriptors are equal.
[[nodiscard]] std::string DescriptorSignature(const Params& params);

/// Calls visit(name, field) for every field, in a fixed order. The names are those of the map file
/// and of `scanloc info --json`; never rename one. A field is a bool, int, double, ShiftMode or
/// std::vector<double>; a name is a string literal. P is Params or const Params.
template <typename P, typename Visitor>
void VisitFields(P& params, Visitor&& visit) {
  visit("voxel_size_m", params.voxel_size_m);
  visit("sensor_height_m", params.sensor_height_m);
  visit("polar.enabled", params.polar.enabled);
  visit("polar.num_rings", params.polar.num_rings);
  visit("polar.num_sectors", params.polar.num_sectors);
  visit("polar.max_range_m", params.polar.max_range_m);
  visit("polar.root_shifts_m", params.polar.root_shifts_m);
  visit("cart.enabled", params.cart.enabled);
  visit("cart.num_rows", params.cart.num_rows);
  visit("cart.num_cols", params.cart.num_cols);
  visit("cart.max_x_m", params.cart.max_x_m);
  visit("cart.max_y_m", params.cart.max_y_m);
  visit("cart.double_flip", params.cart.double_flip);
  visit("cart.shift_mode", params.cart.shift_mode);
  visit("cart.max_shift_cols", params.cart.max_shift_cols);
  visit("structure.enabled", params.structure.enabled);
  visit("search.num_candidates", params.search.num_candidates);
  visit("search.align_radius", params.search.align_radius);
  visit("search.polar_threshold", params.search.polar_threshold);
  visit("search.cart_threshold", params.search.cart_threshold);
  visit("search.min_confidence", params.search.min_confidence);
  visit("search.min_voxels", params.search.min_voxels);
  VisitAutoFields(params.automatic, [&](const char* name, auto& field, auto /*least*/,
                                        auto /*most*/) { visit(name, field); });
}

}  // namespace scanloc
