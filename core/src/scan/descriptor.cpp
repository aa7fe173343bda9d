#include "scanloc/core/scan/descriptor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "absl/strings/str_format.h"

namespace scanloc {
namespace {

std::uint16_t Height_cm(float z_m, float sensor_height_m) {
  const float height_cm = (z_m + sensor_height_m) * 100.0F + 0.5F;
  return static_cast<std::uint16_t>(
      std::clamp(height_cm, 0.0F, static_cast<float>(Context::kMaxHeight_cm)));
}

void Raise(std::uint16_t& cell, std::uint16_t height_cm) { cell = std::max(cell, height_cm); }

/// Finds the sector of a direction without a transcendental function.
///
/// Within a quadrant, |across| / (|along| + |across|) grows with the angle just as the angle does,
/// so sector boundaries are thresholds on it, and a small table gives the first one to try.
/// Opposite quadrants share their thresholds: turning by π moves every point by half the sectors,
/// exactly.
class SectorFinder {
 public:
  explicit SectorFinder(int num_sectors) : num_sectors_(num_sectors) {
    for (int half_quadrant = 0; half_quadrant < 2; ++half_quadrant) {
      // Boundaries b·2π/n that lie inside the quadrant (q·π/2, (q+1)·π/2).
      Quadrant& quadrant = quadrants_[static_cast<std::size_t>(half_quadrant)];
      const double sectors_per_quadrant = num_sectors / 4.0;
      const double begin = half_quadrant * sectors_per_quadrant;
      quadrant.first_sector = static_cast<int>(std::floor(begin));
      for (int b = quadrant.first_sector + 1; b < begin + sectors_per_quadrant; ++b) {
        const double angle = (b - begin) / sectors_per_quadrant * std::numbers::pi / 2.0;
        quadrant.thresholds.push_back(
            static_cast<float>(std::sin(angle) / (std::sin(angle) + std::cos(angle))));
      }
      quadrant.thresholds.push_back(2.0F);  // sentinel: slope never exceeds 1
      std::size_t passed = 0;
      for (int i = 0; i < kTableSize; ++i) {
        while (quadrant.thresholds[passed] <= static_cast<float>(i) / kTableSize) ++passed;
        quadrant.table[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(passed);
      }
    }
  }

  [[nodiscard]] int Find(float x, float y) const {
    float along = 1.0F;
    float across = 0.0F;
    int q = 0;
    if (x > 0.0F && y >= 0.0F) {
      along = x, across = y;
    } else if (x <= 0.0F && y > 0.0F) {
      q = 1, along = y, across = -x;
    } else if (x < 0.0F && y <= 0.0F) {
      q = 2, along = -x, across = -y;
    } else if (x >= 0.0F && y < 0.0F) {
      q = 3, along = -y, across = x;
    }  // else the origin: sector 0
    const Quadrant& quadrant = quadrants_[static_cast<std::size_t>(q & 1)];
    const float slope = across / (along + across);
    std::size_t i = quadrant.table[std::min(static_cast<std::size_t>(slope * kTableSize),
                                            std::size_t{kTableSize - 1})];
    while (slope >= quadrant.thresholds[i]) ++i;
    const int sector = quadrant.first_sector + static_cast<int>(i) + (q >> 1) * (num_sectors_ / 2);
    return sector < num_sectors_ ? sector : sector - num_sectors_;
  }

 private:
  static constexpr int kTableSize = 256;
  struct Quadrant {
    int first_sector = 0;
    std::vector<float> thresholds;
    std::array<std::uint16_t, kTableSize> table{};
  };
  int num_sectors_;
  std::array<Quadrant, 2> quadrants_;
};

class PolarEncoder {
 public:
  explicit PolarEncoder(const PolarParams& params)
      : params_(params),
        max_range_m_(static_cast<float>(params.max_range_m)),
        rings_per_m_(static_cast<float>(params.num_rings / params.max_range_m)),
        sectors_(params.num_sectors) {}

  /// The context seen from a virtual vehicle at (0, root_shift_m); counts the voxels in range.
  Context Encode(const PointCloud& voxels, float sensor_height_m, float root_shift_m,
                 std::uint32_t& num_inside) const {
    Context context{params_.num_rings, params_.num_sectors, {}};
    context.cells_cm.resize(static_cast<std::size_t>(params_.num_rings) * params_.num_sectors);
    num_inside = 0;
    for (const Point& p : voxels) {
      const float y = p.y - root_shift_m;
      const float range_m = std::sqrt(p.x * p.x + y * y);
      if (range_m >= max_range_m_) continue;
      const int ring = std::min(static_cast<int>(range_m * rings_per_m_), params_.num_rings - 1);
      const std::size_t sector = static_cast<std::size_t>(sectors_.Find(p.x, y));
      Raise(context.cells_cm[sector * params_.num_rings + ring], Height_cm(p.z, sensor_height_m));
      ++num_inside;
    }
    return context;
  }

 private:
  PolarParams params_;
  float max_range_m_;
  float rings_per_m_;
  SectorFinder sectors_;
};

class CartEncoder {
 public:
  explicit CartEncoder(const CartParams& params)
      : params_(params),
        rows_per_m_(static_cast<float>(params.num_rows / (2.0 * params.max_x_m))),
        cols_per_m_(static_cast<float>(params.num_cols / (2.0 * params.max_y_m))) {}

  Context Encode(const PointCloud& voxels, float sensor_height_m, std::uint32_t& num_inside) const {
    Context context{params_.num_rows, params_.num_cols, {}};
    context.cells_cm.resize(static_cast<std::size_t>(params_.num_rows) * params_.num_cols);
    num_inside = 0;
    const float half_rows = static_cast<float>(params_.num_rows) / 2.0F;
    const float half_cols = static_cast<float>(params_.num_cols) / 2.0F;
    for (const Point& p : voxels) {
      const float rows_from_zero = std::fabs(p.x) * rows_per_m_;
      const float cols_from_zero = std::fabs(p.y) * cols_per_m_;
      if (rows_from_zero >= half_rows || cols_from_zero >= half_cols) continue;
      const std::size_t row = Bin(rows_from_zero, std::signbit(p.x), params_.num_rows / 2);
      const std::size_t col = Bin(cols_from_zero, std::signbit(p.y), params_.num_cols / 2);
      Raise(context.cells_cm[col * params_.num_rows + row], Height_cm(p.z, sensor_height_m));
      ++num_inside;
    }
    return context;
  }

 private:
  static std::size_t Bin(float bins_from_zero, bool negative, int half) {
    const int bin = static_cast<int>(bins_from_zero);
    return static_cast<std::size_t>(negative ? half - 1 - bin : half + bin);
  }

  CartParams params_;
  float rows_per_m_;
  float cols_per_m_;
};

absl::Status CheckContext(const Context& context, bool enabled, int num_rows, int num_cols,
                          const char* name) {
  const std::size_t num_cells =
      enabled ? static_cast<std::size_t>(num_rows) * static_cast<std::size_t>(num_cols) : 0;
  const bool shape_fits =
      context.cells_cm.size() == num_cells &&
      (!enabled || (context.num_rows == num_rows && context.num_cols == num_cols));
  if (!shape_fits) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "%s context has %d × %d cells (%d given); the map's parameters ask for %d × %d", name,
        context.num_rows, context.num_cols, context.cells_cm.size(), enabled ? num_rows : 0,
        enabled ? num_cols : 0));
  }
  const auto highest = std::max_element(context.cells_cm.begin(), context.cells_cm.end());
  if (highest != context.cells_cm.end() && *highest > Context::kMaxHeight_cm) {
    return absl::InvalidArgumentError(
        absl::StrFormat("%s context holds a height of %d cm; the greatest allowed is %d cm", name,
                        *highest, Context::kMaxHeight_cm));
  }
  return absl::OkStatus();
}

absl::Status CheckStructure(const Structure& structure, const Params& params) {
  if (!params.structure.enabled && !structure.posts.empty()) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "structure has %d posts; the map's parameters ask for none", structure.posts.size()));
  }
  return Validate(structure, params.automatic.posts.reach_m);
}

}  // namespace

ScanDescriptor QueryOf(const PlaceDescriptor& place) {
  ScanDescriptor query;
  if (!place.polar.empty()) query.polar = place.polar.front();
  query.cart = place.cart;
  query.structure = place.structure;
  query.num_voxels = place.num_voxels;
  return query;
}

struct Describer::State {
  explicit State(const Params& p)
      : params(p),
        sensor_height_m(static_cast<float>(p.sensor_height_m)),
        filter(p.voxel_size_m),
        polar(p.polar),
        cart(p.cart),
        structure(p.automatic, p.sensor_height_m) {
    const double voxel_m = p.automatic.posts.voxel_m;
    if (voxel_m > 0.0 && voxel_m != p.voxel_size_m) post_filter.emplace(voxel_m);
  }

  /// The voxels as contexts see them.
  const PointCloud& ForContexts(const Structure& of_scan) {
    const Eigen::Matrix3f turn = ContextFromSensor(of_scan).linear().cast<float>();
    if (turn == Eigen::Matrix3f::Identity()) return filter.centroids();
    turned.clear();
    for (const Point& p : filter.centroids()) {
      const Eigen::Vector3f q = turn * Eigen::Vector3f(p.x, p.y, p.z);
      turned.push_back({q.x(), q.y(), q.z()});
    }
    return turned;
  }

  Params params;
  float sensor_height_m;
  VoxelFilter filter;
  PointCloud turned;
  std::optional<VoxelFilter> post_filter;  // where posts are found in voxels of their own
  PolarEncoder polar;
  CartEncoder cart;
  StructureFinder structure;
};

Describer::Describer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Describer::Describer(Describer&&) noexcept = default;
Describer& Describer::operator=(Describer&&) noexcept = default;
Describer::~Describer() = default;

absl::StatusOr<Describer> Describer::Create(const Params& params) {
  if (absl::Status status = Validate(params); !status.ok()) return status;
  return Describer(std::make_unique<State>(params));
}

std::size_t Describer::held_bytes() const {
  return sizeof(State) + state_->filter.held_bytes() + state_->turned.capacity() * sizeof(Point) +
         (state_->post_filter ? state_->post_filter->held_bytes() : 0) +
         state_->structure.held_bytes();
}

ScanDescriptor Describer::Describe(PointView scan, ScanCounts* counts) {
  return DescribeRows({reinterpret_cast<const float*>(scan.data()), scan.size(), 3}, counts);
}

ScanDescriptor Describer::DescribeRows(const PointRows& scan, ScanCounts* counts) {
  const PointCloud& found = state_->filter.ApplyToRows(scan, counts);
  ScanDescriptor descriptor;
  if (state_->params.structure.enabled) {
    std::optional<VoxelFilter>& own = state_->post_filter;
    descriptor.structure =
        state_->structure.Find(own ? own->ApplyToRows(scan) : found, &descriptor.knows_up);
  }
  const PointCloud& voxels = state_->ForContexts(descriptor.structure);
  std::uint32_t num_polar = 0;
  std::uint32_t num_cart = 0;
  if (state_->params.polar.enabled) {
    descriptor.polar = state_->polar.Encode(voxels, state_->sensor_height_m, 0.0F, num_polar);
  }
  if (state_->params.cart.enabled) {
    descriptor.cart = state_->cart.Encode(voxels, state_->sensor_height_m, num_cart);
  }
  descriptor.num_voxels = std::max(num_polar, num_cart);
  return descriptor;
}

PlaceDescriptor Describer::DescribePlace(PointView scan, ScanCounts* counts) {
  ScanDescriptor own = Describe(scan, counts);
  const PointCloud& voxels = state_->ForContexts(own.structure);
  PlaceDescriptor descriptor;
  descriptor.cart = std::move(own.cart);
  descriptor.structure = std::move(own.structure);
  descriptor.num_voxels = own.num_voxels;
  if (!state_->params.polar.enabled) return descriptor;
  descriptor.polar.push_back(std::move(own.polar));
  for (const double shift_m : state_->params.polar.root_shifts_m) {
    std::uint32_t num_inside = 0;
    descriptor.polar.push_back(state_->polar.Encode(voxels, state_->sensor_height_m,
                                                    static_cast<float>(shift_m), num_inside));
  }
  return descriptor;
}

absl::StatusOr<std::vector<Describer>> MakeDescribers(const Params& params, std::size_t count) {
  std::vector<Describer> describers;
  for (std::size_t i = 0; i < count; ++i) {
    absl::StatusOr<Describer> describer = Describer::Create(params);
    if (!describer.ok()) return describer.status();
    describers.push_back(*std::move(describer));
  }
  return describers;
}

absl::Status Validate(const ScanDescriptor& descriptor, const Params& params) {
  if (absl::Status status = CheckContext(descriptor.polar, params.polar.enabled,
                                         params.polar.num_rings, params.polar.num_sectors, "polar");
      !status.ok()) {
    return status;
  }
  if (absl::Status status = CheckContext(descriptor.cart, params.cart.enabled, params.cart.num_rows,
                                         params.cart.num_cols, "cart");
      !status.ok()) {
    return status;
  }
  return CheckStructure(descriptor.structure, params);
}

absl::Status Validate(const PlaceDescriptor& descriptor, const Params& params) {
  const std::size_t num_polar = params.polar.enabled ? 1 + params.polar.root_shifts_m.size() : 0;
  if (descriptor.polar.size() != num_polar) {
    return absl::InvalidArgumentError(
        absl::StrFormat("place has %d polar contexts; the map's parameters ask for %d",
                        descriptor.polar.size(), num_polar));
  }
  for (const Context& context : descriptor.polar) {
    if (absl::Status status =
            CheckContext(context, true, params.polar.num_rings, params.polar.num_sectors, "polar");
        !status.ok()) {
      return status;
    }
  }
  if (absl::Status status = CheckContext(descriptor.cart, params.cart.enabled, params.cart.num_rows,
                                         params.cart.num_cols, "cart");
      !status.ok()) {
    return status;
  }
  return CheckStructure(descriptor.structure, params);
}

}  // namespace scanloc
