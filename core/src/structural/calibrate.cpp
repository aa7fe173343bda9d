#include "scanloc/core/structural/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "random.hpp"
#include "scanloc/core/map/up.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "structural/auto_search.hpp"

namespace scanloc {
namespace {

/// Places on the same way, uphill or down, rise by less than this.
constexpr double kSlope = 0.2;
/// Across and along up together.
constexpr double kFarAtAll_m = Calibrator::kFar_m * (1.0 + kSlope) + PoseLimits{}.height_m;

/// Azimuths that a vehicle next to the sensor hides.
struct Occlusion {
  double center_rad;
  double half_width_rad;
  [[nodiscard]] bool Hides(double x, double y) const {
    return std::abs(WrapAngle(std::atan2(y, x) - center_rad)) < half_width_rad;
  }
};

void OccludePolar(const Occlusion& occlusion, Context& context) {
  for (int col = 0; col < context.num_cols; ++col) {
    const double azimuth_rad = (col + 0.5) * 2.0 * std::numbers::pi / context.num_cols;
    if (!occlusion.Hides(std::cos(azimuth_rad), std::sin(azimuth_rad))) continue;
    const auto first = context.cells_cm.begin() + std::ptrdiff_t{col} * context.num_rows;
    std::fill(first, first + context.num_rows, std::uint16_t{0});
  }
}

void OccludeCart(const Occlusion& occlusion, const CartParams& params, Context& context) {
  for (int col = 0; col < context.num_cols; ++col) {
    for (int row = 0; row < context.num_rows; ++row) {
      const double x = ((row + 0.5) / context.num_rows * 2.0 - 1.0) * params.max_x_m;
      const double y = ((col + 0.5) / context.num_cols * 2.0 - 1.0) * params.max_y_m;
      if (!occlusion.Hides(x, y)) continue;
      context.cells_cm[static_cast<std::size_t>(col) * context.num_rows + row] = 0;
    }
  }
}

/// The context of a vehicle displaced by whole columns, empty ones coming in.
void ShiftColumns(int num_cols, Context& context) {
  std::vector<std::uint16_t> shifted(context.cells_cm.size());
  for (int col = 0; col < context.num_cols; ++col) {
    const int from = col + num_cols;
    if (from < 0 || from >= context.num_cols) continue;
    std::copy_n(context.cells_cm.begin() + std::ptrdiff_t{from} * context.num_rows,
                context.num_rows, shifted.begin() + std::ptrdiff_t{col} * context.num_rows);
  }
  context.cells_cm = std::move(shifted);
}

std::int16_t Clamped_cm(double value_m, double reach_m) {
  return static_cast<std::int16_t>(
      std::clamp(std::round(value_m * 100.0), -100.0 * reach_m + 1.0, 100.0 * reach_m - 1.0));
}

/// How a later visit sees the posts: some hidden, gone or moved, and some new ones.
void PerturbPosts(const AutoParams& params, const Occlusion& occlusion, double lateral_m,
                  bool reversed, Random& random, Structure& structure) {
  const double reach_m = params.posts.reach_m;
  const double moved_m = 0.2 * params.scale;
  const double around_m = 40.0 * params.scale;
  const double gone_share = random.Uniform(0.1, 0.5);
  const double sign = reversed ? -1.0 : 1.0;
  std::vector<Post> posts;
  for (const Post& post : structure.posts) {
    const double x = sign * post.x_cm * 0.01;
    const double y = sign * (post.y_cm * 0.01 - lateral_m);
    if (random.Chance(gone_share) || occlusion.Hides(x, y)) continue;
    posts.push_back({Clamped_cm(x + random.Uniform(-moved_m, moved_m), reach_m),
                     Clamped_cm(y + random.Uniform(-moved_m, moved_m), reach_m), post.heights});
  }
  const std::size_t num_new = posts.size() / 6;
  for (std::size_t i = 0; i < num_new; ++i) {
    const auto num_heights = static_cast<unsigned>(random.Uniform(1.0, 8.0));
    posts.push_back({Clamped_cm(random.Uniform(-around_m, around_m), reach_m),
                     Clamped_cm(random.Uniform(-around_m, around_m), reach_m),
                     (1U << num_heights) - 1U});
  }
  structure.posts = std::move(posts);
}

/// A later visit to a place: the query, and where it stands in the place's frame.
struct Visit {
  ScanDescriptor query;
  double lateral_m = 0.0;
  double yaw_rad = 0.0;
};

Context ContextOf(PayloadView& payload, DescriptorKind kind, std::size_t entry) {
  const ContextView view = payload.Context(kind, entry);
  return {view.num_rows, view.num_cols, {view.cells_cm.begin(), view.cells_cm.end()}};
}

Visit Perturbed(const Params& params, std::size_t place, PayloadView& payload, Random& random) {
  Visit visit;
  visit.query.num_voxels = static_cast<std::uint32_t>(params.search.min_voxels);
  visit.query.structure = payload.StructureOf(place);
  const bool reversed = random.Chance(0.5);
  visit.yaw_rad = reversed ? std::numbers::pi : 0.0;
  const Occlusion occlusion{random.Uniform(-std::numbers::pi, std::numbers::pi),
                            random.Uniform(0.3, 1.0)};
  if (params.polar.enabled) {
    const std::size_t num_variants = 1 + params.polar.root_shifts_m.size();
    const auto variant =
        static_cast<std::size_t>(random.Uniform(0.0, static_cast<double>(num_variants)));
    visit.lateral_m = variant == 0 ? 0.0 : params.polar.root_shifts_m[variant - 1];
    visit.query.polar = ContextOf(payload, DescriptorKind::kPolar, place * num_variants + variant);
    auto& cells = visit.query.polar.cells_cm;
    if (reversed) {
      std::rotate(cells.begin(), cells.begin() + static_cast<std::ptrdiff_t>(cells.size() / 2),
                  cells.end());
    }
    OccludePolar(occlusion, visit.query.polar);
  }
  if (params.cart.enabled) {
    const std::size_t num_variants = params.cart.double_flip ? 2 : 1;
    visit.query.cart = ContextOf(payload, DescriptorKind::kCart, place * num_variants);
    const double cols_per_m = params.cart.num_cols / (2.0 * params.cart.max_y_m);
    ShiftColumns(static_cast<int>(std::lround(visit.lateral_m * cols_per_m)), visit.query.cart);
    auto& cells = visit.query.cart.cells_cm;
    if (reversed) std::reverse(cells.begin(), cells.end());
    OccludeCart(occlusion, params.cart, visit.query.cart);
  }
  PerturbPosts(params.automatic, occlusion, visit.lateral_m, reversed, random,
               visit.query.structure);
  return visit;
}

}  // namespace

struct Calibrator::State {
  explicit State(std::shared_ptr<const Map> map_in)
      : map(std::move(map_in)), search(*map, FindUp(*map).value_or(Eigen::Vector3d::UnitZ())) {}

  std::shared_ptr<const Map> map;
  AutoSearch search;
};

Calibrator::Calibrator(std::shared_ptr<const Map> map)
    : state_(std::make_unique<const State>(std::move(map))) {}
Calibrator::Calibrator(Calibrator&&) noexcept = default;
Calibrator& Calibrator::operator=(Calibrator&&) noexcept = default;
Calibrator::~Calibrator() = default;

std::size_t Calibrator::num_trials() const {
  return std::min(kMaxTrials, state_->map->places.size());
}

absl::StatusOr<Calibrator::Trial> Calibrator::Run(std::size_t i) const {
  const Map& map = *state_->map;
  const std::size_t place = i * map.places.size() / std::max<std::size_t>(num_trials(), 1);
  Random random(i);
  const SearchControl untimed;
  PayloadView payload(map, untimed);
  const Visit visit = Perturbed(map.params, place, payload, random);
  if (!payload.status().ok()) return payload.status();

  const Eigen::Vector3d& up = state_->search.up();
  const Pose& T_map_place = map.places[place].T_map_place;
  std::vector<bool> excluded(map.places.size());
  for (std::size_t p = 0; p < map.places.size(); ++p) {
    // Most are farther than any of the surroundings, which is cheap to see.
    const Eigen::Vector3d away_m =
        map.places[p].T_map_place.translation() - T_map_place.translation();
    if (away_m.squaredNorm() > kFarAtAll_m * kFarAtAll_m) continue;
    const PoseDifference off = DifferenceOf(map.places[p].T_map_place, T_map_place, up);
    excluded[p] =
        off.plane_m < kFar_m && off.height_m < PoseLimits{}.height_m + kSlope * off.plane_m;
  }

  StageTimes times;
  const absl::StatusOr<std::vector<Spot>> found =
      state_->search.Find(visit.query, {}, {.excluded = &excluded}, times);
  if (!found.ok()) return found.status();
  const std::vector<Spot>& spots = *found;
  Trial trial{.place = static_cast<std::int32_t>(place)};
  const Pose truth = T_map_place * PlanarOffset(visit.lateral_m, visit.yaw_rad);
  if (spots.empty() || !MissOf(DifferenceOf(spots.front().T_map_query, truth, up)).any()) {
    return trial;
  }
  trial.found = spots.front().hypothesis.place;
  trial.confidence = ConfidencesOf(spots, map.params.automatic.evidence, up).front();
  return trial;
}

std::vector<ConfusablePair> FindConfusable(const std::vector<Calibrator::Trial>& trials) {
  constexpr double kWorthAWarning = 0.2;
  std::vector<ConfusablePair> pairs;
  for (const Calibrator::Trial& trial : trials) {
    if (trial.confidence >= kWorthAWarning) {
      pairs.push_back({trial.place, trial.found, trial.confidence});
    }
  }
  std::stable_sort(
      pairs.begin(), pairs.end(),
      [](const ConfusablePair& a, const ConfusablePair& b) { return a.confidence > b.confidence; });
  if (pairs.size() > kMaxConfusable) pairs.resize(kMaxConfusable);
  return pairs;
}

}  // namespace scanloc
