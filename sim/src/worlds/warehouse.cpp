#include <vector>

#include "worlds/scene_builder.hpp"

namespace scanloc::sim {
namespace {

using Eigen::Vector2d;

constexpr double kBay_m = 2.8;
constexpr double kRack_m = 1.1;   // depth of one
constexpr double kCross_m = 4.5;  // aisle across, at both ends

struct Plan {
  int num_aisles;
  int num_bays;
  int num_levels;
  double level_m;
  double aisle_m;  // width
  double filled;   // share of the slots

  [[nodiscard]] double pitch_m() const { return aisle_m + 2.0 * kRack_m; }
  [[nodiscard]] double racks_m() const { return num_bays * kBay_m; }
  [[nodiscard]] double aisle_at_m(int i) const { return (i + 0.5) * pitch_m(); }
  [[nodiscard]] double high_m() const { return num_levels * level_m + 1.5; }
};

Plan MakePlan(const SceneOptions& options) {
  Random random(Mix(options.seed, 0x3A3E));
  Plan plan;
  plan.num_aisles = options.world.num_aisles;
  plan.num_bays = 12 + random.Index(8);
  plan.num_levels = 3 + random.Index(2);
  plan.level_m = random.Uniform(1.6, 2.0);
  plan.aisle_m = random.Uniform(2.7, 3.3);
  plan.filled = random.Uniform(0.65, 0.9);
  return plan;
}

/// Up one aisle and down the next.
std::vector<Vector2d> Way(const Plan& plan) {
  const double south = -0.5 * kCross_m;
  const double north = plan.racks_m() + 0.5 * kCross_m;
  std::vector<Vector2d> way;
  for (int i = 0; i < plan.num_aisles; ++i) {
    const bool up = i % 2 == 0;
    way.emplace_back(plan.aisle_at_m(i), up ? south : north);
    way.emplace_back(plan.aisle_at_m(i), up ? north : south);
  }
  return way;
}

void BuildFrame(const Plan& plan, double x, SceneBuilder* to) {
  const double top = plan.num_levels * plan.level_m;
  for (int bay = 0; bay <= plan.num_bays; ++bay) {
    for (const double dx : {-0.45 * kRack_m, 0.45 * kRack_m}) {
      to->Box({x + dx, bay * kBay_m}, {0.1, 0.1}, 0.0, top);
    }
  }
  for (int level = 1; level < plan.num_levels; ++level) {
    const double high = level * plan.level_m;
    for (const double dx : {-0.45 * kRack_m, 0.45 * kRack_m}) {
      to->Box({x + dx, 0.5 * plan.racks_m()}, {0.05, plan.racks_m()}, high - 0.12, high);
    }
  }
}

void Stock(const Plan& plan, double x, SceneBuilder* to) {
  for (int bay = 0; bay < plan.num_bays; ++bay) {
    for (int level = 0; level < plan.num_levels; ++level) {
      for (int slot = 0; slot < 2; ++slot) {
        Random random = to->NextThing();
        if (!random.Chance(plan.filled)) continue;
        const double width = random.Uniform(0.8, 1.25);
        const double depth = random.Uniform(0.7, 1.05);
        const double along = (bay + 0.27 + 0.46 * slot) * kBay_m + random.Uniform(-0.06, 0.06);
        const double low = level * plan.level_m;
        const double high = low + random.Uniform(0.35, plan.level_m - 0.3);
        to->Box({x + random.Uniform(-0.05, 0.05), along}, {depth, width}, low, high);
      }
    }
  }
}

void BuildHall(const Plan& plan, std::uint64_t seed, SceneBuilder* to) {
  Random random(Mix(seed, 0x4A11));
  const double margin = random.Uniform(1.0, 4.0);
  const double yard = random.Uniform(6.0, 14.0);
  const Rect hall{{-margin, -kCross_m - yard},
                  {plan.num_aisles * plan.pitch_m() + margin, plan.racks_m() + kCross_m}};
  to->Walls(hall, plan.high_m(), 0.25);
  to->Slab(hall, plan.high_m(), plan.high_m() + 0.2);
  // Docks, an office and machines in the yard: what tells one end from the other.
  for (int i = 0; i < 2 + plan.num_aisles / 2; ++i) {
    const double x = random.Uniform(hall.low.x() + 2.0, hall.high.x() - 2.0);
    const double length = random.Uniform(1.5, 4.0);
    const double depth = random.Uniform(0.8, 2.5);
    const double height = random.Uniform(0.8, 3.0);
    to->PutLoose({x, hall.low.y() + 0.5 * depth + random.Uniform(0.2, yard - 3.0)}, {length, depth},
                 0.0, height);
  }
}

}  // namespace

Scene MakeWarehouse(const SceneOptions& options) {
  const Plan plan = MakePlan(options);
  const std::vector<Vector2d> way = Way(plan);
  SceneBuilder builder(options);
  builder.BeginStorey(0.0, way, 1.0);
  BuildHall(plan, options.seed, &builder);
  for (int i = 0; i < plan.num_aisles; ++i) {
    for (const double side : {-1.0, 1.0}) {
      const double x = plan.aisle_at_m(i) + side * 0.5 * (plan.aisle_m + kRack_m);
      BuildFrame(plan, x, &builder);
      Stock(plan, x, &builder);
    }
  }
  builder.People({{0.0, -kCross_m}, {plan.num_aisles * plan.pitch_m(), plan.racks_m() + kCross_m}},
                 4 + plan.num_aisles);
  builder.WalkAlong(way);
  return builder.Finish(options.length_m);
}

}  // namespace scanloc::sim
