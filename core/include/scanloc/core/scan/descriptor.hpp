#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/structure.hpp"
#include "scanloc/core/scan/voxel_filter.hpp"

namespace scanloc {

/// One scan context descriptor (paper, Sec. IV): a matrix of heights above ground, rows along the
/// retrieval axis, columns along the aligning axis.
///
/// Heights are whole centimetres in [0, kMaxHeight_cm]; an empty bin is 0. Integers make distances,
/// keys and so answers the same bits on every machine, and a third of the size of floats.
struct Context {
  static constexpr std::uint16_t kMaxHeight_cm = 8191;

  int num_rows = 0;
  int num_cols = 0;
  std::vector<std::uint16_t> cells_cm;  ///< num_cols columns of num_rows, one behind the other

  [[nodiscard]] std::uint16_t At(int row, int col) const {
    return cells_cm[static_cast<std::size_t>(col) * num_rows + row];
  }
  [[nodiscard]] bool empty() const { return cells_cm.empty(); }

  friend bool operator==(const Context&, const Context&) = default;
};

/// What a query needs of one scan: both contexts and the structure; a kind of context that is not
/// enabled is empty().
struct ScanDescriptor {
  Context polar;
  Context cart;
  Structure structure;           ///< without posts where it is not enabled
  std::uint32_t num_voxels = 0;  ///< inside the region of interest of an enabled kind
  /// False: the structure was to be found, and of no direction can be said that it is up.
  bool knows_up = true;

  friend bool operator==(const ScanDescriptor&, const ScanDescriptor&) = default;
};

/// What a map holds of one place. The double flip of the cart context is not stored: it is exactly
/// the reversed cells.
struct PlaceDescriptor {
  std::vector<Context> polar;  ///< the place, then one per root shift, as in PolarParams; or empty
  Context cart;                ///< or empty()
  Structure structure;
  std::uint32_t num_voxels = 0;

  friend bool operator==(const PlaceDescriptor&, const PlaceDescriptor&) = default;
};

/// A mapped scan, asked about again: without its root-shifted contexts.
[[nodiscard]] ScanDescriptor QueryOf(const PlaceDescriptor& place);

/// Makes descriptors of scans.
///
/// Polar context (paper, Sec. IV-D1): num_rings × num_sectors; cell (i, j) holds the greatest
/// z + sensor_height_m among the voxel centroids with range in [i, i+1)·max_range_m/num_rings and
/// azimuth in [j, j+1)·2π/num_sectors, counter-clockwise from +x.
///
/// Cart context (Sec. IV-D2): num_rows × num_cols; rows along x from -max_x_m, columns along y from
/// -max_y_m. Bins are half-open and symmetric about zero, so that reversing all cells is exactly
/// the descriptor of the reversed vehicle.
///
/// Reuses its buffers from scan to scan; use one per thread.
class Describer {
 public:
  /// InvalidArgument if Validate(params) is not OK.
  [[nodiscard]] static absl::StatusOr<Describer> Create(const Params& params);

  Describer(Describer&&) noexcept;
  Describer& operator=(Describer&&) noexcept;
  ~Describer();

  /// The descriptors of a query. An empty scan gives zeros.
  [[nodiscard]] ScanDescriptor Describe(PointView scan, ScanCounts* counts = nullptr);
  [[nodiscard]] ScanDescriptor DescribeRows(const PointRows& scan, ScanCounts* counts = nullptr);

  /// The descriptors of a place of a map: those of Describe and the root-shifted polar contexts.
  [[nodiscard]] PlaceDescriptor DescribePlace(PointView scan, ScanCounts* counts = nullptr);

  /// What it keeps for the next scan [bytes]: it grows with the largest so far.
  [[nodiscard]] std::size_t held_bytes() const;

 private:
  struct State;
  explicit Describer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// One for each of so many threads. InvalidArgument if Validate(params) is not OK.
[[nodiscard]] absl::StatusOr<std::vector<Describer>> MakeDescribers(const Params& params,
                                                                    std::size_t count);

/// OK if the descriptors have the shapes and heights that the parameters ask for, else
/// InvalidArgument; for descriptors that come from a file or the network.
[[nodiscard]] absl::Status Validate(const ScanDescriptor& descriptor, const Params& params);
[[nodiscard]] absl::Status Validate(const PlaceDescriptor& descriptor, const Params& params);

}  // namespace scanloc
