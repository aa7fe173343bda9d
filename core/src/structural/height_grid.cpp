#include "structural/height_grid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "scan/simd.hpp"

namespace scanloc {
namespace {

constexpr std::uint32_t kAllHeights = (1U << static_cast<unsigned>(Post::kNumHeights)) - 1U;
// Around the grid: no post's neighbours lie outside, and what is beyond falls on empty cells.
constexpr int kMargin = 3;

struct View {
  const std::uint32_t* __restrict cells;
  const float* __restrict reach_squared_m;  // by sector
  int side;
  float cosine, sine, x_m, y_m, cells_per_m, middle, last;
  // In cells above the lowest height.
  float sensor_height, lowest_slope, highest_slope;
};

struct MetCounts {
  int num_heights = 0;
  int num_met = 0;
};

/// The bits that are set; not std::popcount, so that loops over it become vectors.
inline int CountBits(std::uint32_t bits) {
  bits -= (bits >> 1U) & 0x55555555U;
  bits = (bits & 0x33333333U) + ((bits >> 2U) & 0x33333333U);
  bits = (bits + (bits >> 4U)) & 0x0f0f0f0fU;
  return static_cast<int>((bits * 0x01010101U) >> 24U);
}

/// The lowest so many heights.
inline std::uint32_t Lowest(float num_heights) {
  const float bounded =
      std::min(std::max(num_heights, 0.0F), static_cast<float>(Post::kNumHeights));
  return (1U << static_cast<std::uint32_t>(static_cast<std::int32_t>(bounded))) - 1U;
}

SCANLOC_SIMD MetCounts CountMet(const View& given, const PlanarPoints& points) {
  const View view = given;
  const float* __restrict x_m = points.x_m().data();
  const float* __restrict y_m = points.y_m().data();
  const std::uint32_t* __restrict heights = points.heights().data();
  int num_heights[PlanarPoints::kBlock] = {};
  int num_met[PlanarPoints::kBlock] = {};
  for (std::size_t begin = 0; begin < points.x_m().size(); begin += PlanarPoints::kBlock) {
    for (std::size_t lane = 0; lane < PlanarPoints::kBlock; ++lane) {
      const float given_x = x_m[begin + lane];
      const float given_y = y_m[begin + lane];
      const float x = view.cosine * given_x - view.sine * given_y + view.x_m;
      const float y = view.sine * given_x + view.cosine * given_y + view.y_m;
      const float range_squared = x * x + y * y;
      const float range = std::sqrt(range_squared) * view.cells_per_m;
      // Whole cells only: of those that the view cuts, either scan may have seen a part.
      const std::uint32_t in_view =
          Lowest(view.sensor_height + range * view.highest_slope) &
          ~Lowest(view.sensor_height + range * view.lowest_slope + 0.999F);
      const bool is_in_reach = range_squared < view.reach_squared_m[Horizon::SectorOf(x, y)];
      const std::uint32_t here = is_in_reach ? heights[begin + lane] & in_view : 0U;
      const float u = std::min(std::max(x * view.cells_per_m + view.middle, 0.0F), view.last);
      const float v = std::min(std::max(y * view.cells_per_m + view.middle, 0.0F), view.last);
      // Along its row a cell holds what is beside it; the rows beside are looked up.
      const int row = std::min(std::max(static_cast<int>(v), 1), view.side - 2);
      const int cell = row * view.side + static_cast<int>(u);
      const std::uint32_t there =
          view.cells[cell - view.side] | view.cells[cell] | view.cells[cell + view.side];
      num_heights[lane] += CountBits(here);
      num_met[lane] += CountBits(here & there);
    }
  }
  MetCounts seen;
  for (std::size_t lane = 0; lane < PlanarPoints::kBlock; ++lane) {
    seen.num_heights += num_heights[lane];
    seen.num_met += num_met[lane];
  }
  return seen;
}

}  // namespace

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
  const MetCounts seen = CountMet(
      {.cells = cells_.data(),
       .reach_squared_m = horizon == nullptr ? kEndless.data() : horizon->reach_squared_m().data(),
       .side = side_,
       .cosine = static_cast<float>(std::cos(T_grid_points.yaw_rad)),
       .sine = static_cast<float>(std::sin(T_grid_points.yaw_rad)),
       .x_m = static_cast<float>(T_grid_points.x_m),
       .y_m = static_cast<float>(T_grid_points.y_m),
       .cells_per_m = 1.0F / cell_m_,
       .middle = 0.5F * static_cast<float>(side_),
       .last = static_cast<float>(side_) - 0.5F,
       .sensor_height = sensor_height_m_ / cell_m_ - 0.5F,
       .lowest_slope = lowest_slope_,
       .highest_slope = highest_slope_},
      points);
  return seen.num_heights == 0 ? 0.0 : static_cast<double>(seen.num_met) / seen.num_heights;
}

}  // namespace scanloc
