#include "structural/height_grid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "scan/avx512.hpp"
#include "scan/simd.hpp"
#include "structural/height_kernels.hpp"

namespace scanloc {
namespace {

constexpr std::uint32_t kAllHeights = (1U << static_cast<unsigned>(Post::kNumHeights)) - 1U;
// Around the grid: no post's neighbours lie outside, and what is beyond falls on empty cells.
constexpr int kMargin = 3;

/// A number of heights, counted from the lowest.
inline std::int32_t Bounded(float num_heights) {
  return static_cast<std::int32_t>(
      std::min(std::max(num_heights, 0.0F), static_cast<float>(Post::kNumHeights)));
}

SCANLOC_SIMD MetCounts CountMetPortably(const HeightView& given,
                                        const std::uint32_t* __restrict cells,
                                        const float* __restrict reach_squared_m,
                                        const float* __restrict x_m, const float* __restrict y_m,
                                        const std::uint32_t* __restrict heights,
                                        std::size_t num_points) {
  const HeightView view = given;
  MetCounts seen;
  for (std::size_t begin = 0; begin < num_points; begin += PlanarPoints::kBlock) {
    // Without what is looked up, so that the loop becomes vectors.
    std::int32_t sectors[PlanarPoints::kBlock];
    std::int32_t at[PlanarPoints::kBlock];
    std::int32_t lowest[PlanarPoints::kBlock];
    std::int32_t highest[PlanarPoints::kBlock];
    float ranges_squared[PlanarPoints::kBlock];
    for (std::size_t lane = 0; lane < PlanarPoints::kBlock; ++lane) {
      const float given_x = x_m[begin + lane];
      const float given_y = y_m[begin + lane];
      const float x = view.cosine * given_x - view.sine * given_y + view.x_m;
      const float y = view.sine * given_x + view.cosine * given_y + view.y_m;
      ranges_squared[lane] = x * x + y * y;
      // Whole cells only: of those that the view cuts, either scan may have seen a part.
      const float range = __builtin_sqrtf(ranges_squared[lane]) * view.cells_per_m;
      highest[lane] = Bounded(view.sensor_height + range * view.highest_slope);
      lowest[lane] = Bounded(view.sensor_height + range * view.lowest_slope + 0.999F);
      sectors[lane] = Horizon::SectorOf(x, y);
      const float u = std::min(std::max(x * view.cells_per_m + view.middle, 0.0F), view.last);
      const float v = std::min(std::max(y * view.cells_per_m + view.middle, 0.0F), view.last);
      const int row = std::min(std::max(static_cast<int>(v), 1), view.side - 2);
      at[lane] = row * view.side + static_cast<int>(u);
    }
    for (std::size_t lane = 0; lane < PlanarPoints::kBlock; ++lane) {
      const bool is_in_reach = ranges_squared[lane] < reach_squared_m[sectors[lane]];
      const std::uint32_t in_view = ((1U << highest[lane]) - 1U) & ~((1U << lowest[lane]) - 1U);
      const std::uint32_t here = is_in_reach ? heights[begin + lane] & in_view : 0U;
      // Along its row a cell holds what is beside it; the rows beside are looked up.
      const std::uint32_t* const cell = cells + at[lane];
      const std::uint32_t there = cell[-view.side] | cell[0] | cell[view.side];
      seen.num_heights += std::popcount(here);
      seen.num_met += std::popcount(here & there);
    }
  }
  return seen;
}

}  // namespace

std::vector<HeightKernel> HeightKernels() {
  std::vector<HeightKernel> kernels;
#ifdef __x86_64__
  if (avx512::IsQuick()) kernels.push_back(&CountMetByAvx512);
#endif
  kernels.push_back(&CountMetPortably);
  return kernels;
}

HeightGrid::HeightGrid(const PostParams& params)
    : cell_m_(static_cast<float>(params.cell_m)),
      side_(2 * (static_cast<int>(std::ceil(params.reach_m / params.cell_m)) + kMargin)),
      cells_(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_)) {}

void HeightGrid::FindView(const PlanarPoints& posts) {
  // Of what is nearer the cells are too coarse to say how steeply it is seen.
  constexpr float kLeastRange = 10.0F;  // in cells
  constexpr float kAnySlope = 1e3F;
  lowest_slope_ = kAnySlope;
  highest_slope_ = -kAnySlope;
  for (std::size_t i = 0; i < posts.size(); ++i) {
    const float x_m = posts.x_m()[i];
    const float y_m = posts.y_m()[i];
    const float range = std::sqrt(x_m * x_m + y_m * y_m);
    const std::uint32_t heights = posts.heights()[i];
    if (heights == 0U || range < kLeastRange * cell_m_) continue;
    const auto above_m = [&](int num_cells) {
      return (static_cast<float>(num_cells) + 0.5F) * cell_m_ - sensor_height_m_;
    };
    highest_slope_ = std::max(highest_slope_, above_m(std::bit_width(heights) - 1) / range);
    lowest_slope_ = std::min(lowest_slope_, above_m(std::countr_zero(heights) + 1) / range);
  }
  if (lowest_slope_ > highest_slope_) std::swap(lowest_slope_, highest_slope_);
}

void HeightGrid::Fill(const PlanarPoints& posts, double sensor_height_m) {
  sensor_height_m_ = static_cast<float>(sensor_height_m);
  FindView(posts);
  for (const std::uint32_t first : touched_) std::fill_n(&cells_[first], 3, 0U);
  touched_.clear();
  const float half = 0.5F * static_cast<float>(side_);  // which is even
  const auto side = static_cast<std::size_t>(side_);
  for (std::size_t i = 0; i < posts.size(); ++i) {
    const int column = static_cast<int>(posts.x_m()[i] / cell_m_ + half);
    const int row = static_cast<int>(posts.y_m()[i] / cell_m_ + half);
    if (column < 1 || row < 1 || column > side_ - 2 || row > side_ - 2) continue;
    const std::uint32_t heights = posts.heights()[i];
    const std::uint32_t beside = (heights | heights << 1U | heights >> 1U) & kAllHeights;
    const std::size_t first =
        static_cast<std::size_t>(row) * side + static_cast<std::size_t>(column - 1);
    for (std::size_t dx = 0; dx < 3; ++dx) cells_[first + dx] |= beside;
    touched_.push_back(static_cast<std::uint32_t>(first));
  }
}

double HeightGrid::Overlap(const PlanarPoints& points, const PlanarPose& T_grid_points,
                           const Horizon* horizon) const {
  static constexpr auto kEndless = [] {
    std::array<float, Horizon::kNumSectors> endless{};
    endless.fill(1e30F);
    return endless;
  }();
  static const HeightKernel kCountMet = HeightKernels().front();
  const HeightView view = {.side = side_,
                           .cosine = static_cast<float>(std::cos(T_grid_points.yaw_rad)),
                           .sine = static_cast<float>(std::sin(T_grid_points.yaw_rad)),
                           .x_m = static_cast<float>(T_grid_points.x_m),
                           .y_m = static_cast<float>(T_grid_points.y_m),
                           .cells_per_m = 1.0F / cell_m_,
                           .middle = 0.5F * static_cast<float>(side_),
                           .last = static_cast<float>(side_) - 0.5F,
                           .sensor_height = sensor_height_m_ / cell_m_ - 0.5F,
                           .lowest_slope = lowest_slope_,
                           .highest_slope = highest_slope_};
  const float* reach_squared_m =
      horizon == nullptr ? kEndless.data() : horizon->reach_squared_m().data();
  const MetCounts seen =
      kCountMet(view, cells_.data(), reach_squared_m, points.x_m().data(), points.y_m().data(),
                points.heights().data(), points.x_m().size());
  return seen.num_heights == 0 ? 0.0 : static_cast<double>(seen.num_met) / seen.num_heights;
}

}  // namespace scanloc
