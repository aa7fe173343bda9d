#include "scanloc/core/params.hpp"

#include <tuple>

#include "absl/strings/str_format.h"
#include "scanloc/core/auto_fields.hpp"
#include "scanloc/core/limits.hpp"

namespace scanloc {
namespace {

/// Cells from the sensor to the end of a grid: 8 MB a grid at most.
constexpr double kMaxCellsReach = 600.0;
constexpr double kMinVoxel_m = 0.05;

class Checker {
 public:
  void Range(const char* name, double value, double low, double high) {
    if (!status_.ok() || (value >= low && value <= high)) return;  // NaN fails the comparison
    status_ = absl::InvalidArgumentError(
        absl::StrFormat("parameter %s is %g; it must be in [%g, %g]", name, value, low, high));
  }
  void Even(const char* name, int value) {
    if (!status_.ok() || value % 2 == 0) return;
    status_ = absl::InvalidArgumentError(
        absl::StrFormat("parameter %s is %d; it must be even", name, value));
  }
  void That(bool condition, const char* message) {
    if (status_.ok() && !condition) status_ = absl::InvalidArgumentError(message);
  }
  [[nodiscard]] absl::Status status() const { return status_; }

 private:
  absl::Status status_;
};

}  // namespace

absl::Status Validate(const Params& params) {
  Checker check;
  check.Range("voxel_size_m", params.voxel_size_m, 0.05, 10.0);
  check.Range("sensor_height_m", params.sensor_height_m, -100.0, 100.0);
  check.That(params.polar.enabled || params.cart.enabled,
             "parameters polar.enabled and cart.enabled are both false; enable at least one");

  const PolarParams& polar = params.polar;
  check.Range("polar.num_rings", polar.num_rings, 1, limits::kMaxDescriptorSide);
  check.Range("polar.num_sectors", polar.num_sectors, 2, limits::kMaxDescriptorSide);
  check.Even("polar.num_sectors", polar.num_sectors);
  check.Range("polar.max_range_m", polar.max_range_m, 1.0, 1000.0);
  check.Range("number of polar.root_shifts_m", static_cast<double>(polar.root_shifts_m.size()), 0,
              limits::kMaxRootShifts);
  for (const double shift_m : polar.root_shifts_m) {
    check.Range("polar.root_shifts_m", shift_m, -50.0, 50.0);
  }

  const CartParams& cart = params.cart;
  check.Range("cart.num_rows", cart.num_rows, 2, limits::kMaxDescriptorSide);
  check.Even("cart.num_rows", cart.num_rows);
  check.Range("cart.num_cols", cart.num_cols, 2, limits::kMaxDescriptorSide);
  check.Even("cart.num_cols", cart.num_cols);
  check.Range("cart.max_x_m", cart.max_x_m, 1.0, 1000.0);
  check.Range("cart.max_y_m", cart.max_y_m, 1.0, 1000.0);
  check.That(cart.shift_mode == ShiftMode::kCircular || cart.shift_mode == ShiftMode::kBounded,
             "parameter cart.shift_mode must be 0 (circular) or 1 (bounded)");
  check.Range("cart.max_shift_cols", cart.max_shift_cols, 0, cart.num_cols - 1);

  const SearchParams& search = params.search;
  check.Range("search.num_candidates", search.num_candidates, 1, limits::kMaxCandidates);
  check.Range("search.align_radius", search.align_radius, 0, limits::kMaxDescriptorSide);
  check.Range("search.polar_threshold", search.polar_threshold, 0.0, 1.0);
  check.Range("search.cart_threshold", search.cart_threshold, 0.0, 1.0);
  check.Range("search.min_confidence", params.search.min_confidence, 0.01, 0.999);
  check.Range("search.min_voxels", search.min_voxels, 1, limits::kMaxPointsPerScan);

  VisitAutoFields(params.automatic, [&](const char* name, auto field, auto least, auto most) {
    check.Range(name, field, least, most);
  });
  const PostParams& posts = params.automatic.posts;
  check.That(posts.voxel_m == 0.0 || posts.voxel_m >= kMinVoxel_m,
             "parameter auto.posts.voxel_m must be 0 (the contexts' voxels) or at least 0.05");
  const VerificationParams& verify = params.automatic.verify;
  const GroundParams& ground = params.automatic.ground;
  for (const auto& [name, reach_m, cell_m] :
       {std::tuple("auto.posts.reach_m", posts.reach_m, posts.cell_m),
        std::tuple("auto.ground.reach_m", ground.reach_m, ground.cell_m),
        std::tuple("auto.posts.reach_m", posts.reach_m, verify.coarse_cell_m),
        std::tuple("auto.posts.reach_m", posts.reach_m, verify.fine_cell_m)}) {
    check.Range(name, reach_m, 2.0 * cell_m, kMaxCellsReach * cell_m);
  }
  check.Range("auto.verify.fine_cell_m", verify.fine_cell_m, 0.0, verify.cutoff_m);
  check.Range("auto.verify.coarse_cell_m", verify.coarse_cell_m, 0.0, verify.cutoff_m);
  // Beyond, the exponential that scores is no number any more.
  check.Range("auto.verify.cutoff_m", verify.cutoff_m, 0.0, 13.0 * verify.overlap_m);
  return check.status();
}

std::string DescriptorSignature(const Params& params) {
  std::string signature =
      absl::StrFormat("scd2 voxel=%.17g height=%.17g", params.voxel_size_m, params.sensor_height_m);
  if (params.polar.enabled) {
    absl::StrAppendFormat(&signature, " polar=%dx%d/%.17g", params.polar.num_rings,
                          params.polar.num_sectors, params.polar.max_range_m);
  }
  if (params.cart.enabled) {
    absl::StrAppendFormat(&signature, " cart=%dx%d/%.17g,%.17g", params.cart.num_rows,
                          params.cart.num_cols, params.cart.max_x_m, params.cart.max_y_m);
  }
  if (params.structure.enabled) {
    const auto& [posts, ground] = std::tie(params.automatic.posts, params.automatic.ground);
    absl::StrAppendFormat(&signature, " posts=%.17g,%.17g,%.17g,%.17g", posts.voxel_m, posts.cell_m,
                          posts.reach_m, posts.min_extent_m);
    absl::StrAppendFormat(&signature, " ground=%.17g,%.17g,%d,%.17g,%.17g,%.17g,%.17g",
                          ground.reach_m, ground.cell_m, ground.min_cells, ground.low_share,
                          ground.wide_m, ground.narrow_m, ground.max_tilt_rad);
  }
  return signature;
}

}  // namespace scanloc
