#include <vector>

#include "worlds/scene_builder.hpp"

namespace scanloc::sim {
namespace {

using Eigen::Vector2d;

constexpr double kSlab_m = 0.3;
constexpr double kHalfDepth_m = 16.0;
constexpr double kRampOut_m = 20.5;  // the far side of the strip along which the ramps run
constexpr double kRampAt_m = 18.25;  // its middle
constexpr double kAisle_m = 8.0;     // of an aisle's middle from the axis

struct Plan {
  double bay_m;
  double length_m;
  double deck_m;  // from one to the next
  double core_at_m;
  double ramp_begin_m, ramp_end_m;
  int bays_to_pillar;   // from one to the next
  double pillar_row_m;  // of the inner rows from the axis
};

Plan MakePlan(std::uint64_t seed) {
  Random random(Mix(seed, 0x6A4A6E));
  Plan plan;
  plan.bay_m = random.Uniform(2.4, 2.7);
  plan.length_m = 52.0 + plan.bay_m * random.Index(6);
  plan.deck_m = random.Uniform(2.8, 3.2);
  plan.core_at_m = random.Uniform(20.0, plan.length_m - 20.0);
  plan.ramp_begin_m = random.Uniform(8.0, 14.0);
  plan.ramp_end_m = plan.ramp_begin_m + random.Uniform(21.0, 26.0);
  plan.bays_to_pillar = 2 + random.Index(2);
  plan.pillar_row_m = random.Uniform(5.1, 5.6);
  return plan;
}

/// Round the deck, from where the ramp ends to where the next begins.
std::vector<Vector2d> Way(const Plan& plan, bool from_street) {
  const double far = plan.length_m - 5.0;
  std::vector<Vector2d> way;
  if (from_street) {
    way = {{plan.length_m + 30.0, kAisle_m}, {far, kAisle_m}};
  } else {
    way = {{plan.ramp_end_m + 3.0, kRampAt_m}, {plan.ramp_end_m + 3.0, kAisle_m}, {far, kAisle_m}};
  }
  way.insert(
      way.end(),
      {{far, -kAisle_m}, {5.0, -kAisle_m}, {5.0, kAisle_m}, {plan.ramp_begin_m - 3.0, kRampAt_m}});
  return way;
}

void BuildDeckFloor(const Plan& plan, SceneBuilder* to) {
  to->Slab({{0.0, -kHalfDepth_m}, {plan.length_m, kHalfDepth_m}}, -kSlab_m, 0.0);
  to->Slab({{0.0, kHalfDepth_m}, {plan.ramp_begin_m, kRampOut_m}}, -kSlab_m, 0.0);
  to->Slab({{plan.ramp_end_m, kHalfDepth_m}, {plan.length_m, kRampOut_m}}, -kSlab_m, 0.0);
}

void BuildDeck(const Plan& plan, bool has_entrance, SceneBuilder* to) {
  constexpr double kParapet_m = 1.1;
  const double high = plan.deck_m - kSlab_m;
  const double end = plan.length_m;
  to->Wall({0.0, -kHalfDepth_m}, {end, -kHalfDepth_m}, kParapet_m);
  to->Wall({0.0, -kHalfDepth_m}, {0.0, kRampOut_m}, kParapet_m);
  to->Wall({0.0, kRampOut_m}, {end, kRampOut_m}, kParapet_m);
  to->Wall({plan.ramp_begin_m, kHalfDepth_m}, {plan.ramp_end_m, kHalfDepth_m}, kParapet_m);
  if (has_entrance) {
    to->Wall({end, -kHalfDepth_m}, {end, kAisle_m - 3.5}, kParapet_m);
    to->Wall({end, kAisle_m + 3.5}, {end, kRampOut_m}, kParapet_m);
  } else {
    to->Wall({end, -kHalfDepth_m}, {end, kRampOut_m}, kParapet_m);
  }
  for (double x = 0.3; x < end; x += plan.bays_to_pillar * plan.bay_m) {
    for (const double y :
         {-kHalfDepth_m + 0.3, -plan.pillar_row_m, plan.pillar_row_m, kHalfDepth_m - 0.3}) {
      to->PutLoose({x, y}, {0.5, 0.5}, 0.0, high);  // none in the way
    }
  }
  to->Walls({{plan.core_at_m, -2.2}, {plan.core_at_m + 5.0, 2.2}}, high);
}

/// A ramp of low steps.
void BuildRamp(const Plan& plan, SceneBuilder* to) {
  constexpr int kNumSteps = 60;
  const double step = (plan.ramp_end_m - plan.ramp_begin_m) / kNumSteps;
  for (int i = 0; i < kNumSteps; ++i) {
    const double up = plan.deck_m * (i + 0.5) / kNumSteps;
    to->Box({plan.ramp_begin_m + step * (i + 0.5), kRampAt_m}, {step, 4.2}, up - kSlab_m, up);
  }
}

void Park(const Plan& plan, SceneBuilder* to) {
  constexpr double kParked = 0.6;
  for (const double y : {-13.4, -2.7, 2.7, 13.4}) {
    for (double x = 10.0; x + plan.bay_m < plan.length_m - 9.0; x += plan.bay_m) {
      Random random = to->NextThing(1.0);
      const bool is_core =
          (y == -2.7 || y == 2.7) && x + plan.bay_m > plan.core_at_m && x < plan.core_at_m + 5.0;
      if (!random.Chance(kParked) || is_core) continue;
      const double aside = random.Uniform(-0.15, 0.15);
      const double ahead = random.Uniform(-0.3, 0.3);
      const Vector2d axis(0.0, random.Chance(0.5) ? 1.0 : -1.0);
      to->Car({x + 0.5 * plan.bay_m + aside, y + ahead}, axis, random);
    }
  }
}

void BuildStreet(const Plan& plan, std::uint64_t seed, SceneBuilder* to) {
  Random random(Mix(seed, 0x57));
  for (int i = 0; i < 12; ++i) {
    const double x = random.Uniform(plan.length_m + 4.0, plan.length_m + 40.0);
    const double side = random.Chance(0.5) ? 1.0 : -1.0;
    to->Tree({x, kAisle_m + side * random.Uniform(4.5, 14.0)}, 0.0, random,
             random.Uniform(0.7, 1.2));
  }
  for (const double side : {1.0, -1.0}) {
    const double width = random.Uniform(10.0, 22.0);
    const double x = plan.length_m + random.Uniform(18.0, 35.0);
    const double y = kAisle_m + side * random.Uniform(26.0, 34.0);
    to->Box({x, y}, {width, 14.0}, 0.0, random.Uniform(6.0, 16.0));
  }
}

}  // namespace

Scene MakeGarage(const SceneOptions& options) {
  const Plan plan = MakePlan(options.seed);
  SceneBuilder builder(options);
  const int num_decks = options.world.num_floors;
  for (int deck = 0; deck < num_decks; ++deck) {
    const std::vector<Vector2d> way = Way(plan, deck == 0);
    builder.BeginStorey(deck * plan.deck_m, way, 1.3);
    if (deck > 0) BuildDeckFloor(plan, &builder);
    BuildDeck(plan, deck == 0, &builder);
    if (deck == 0) BuildStreet(plan, options.seed, &builder);
    Park(plan, &builder);
    builder.People({{2.0, -kHalfDepth_m}, {plan.length_m - 2.0, kHalfDepth_m}}, 3);
    builder.WalkAlong(way);
    if (deck + 1 == num_decks) break;
    BuildRamp(plan, &builder);
    builder.WalkTo({plan.ramp_begin_m, kRampAt_m});
    builder.WalkTo({plan.ramp_end_m, kRampAt_m}, plan.deck_m);
  }
  builder.BeginStorey(num_decks * plan.deck_m, {});
  BuildDeckFloor(plan, &builder);
  return builder.Finish(options.length_m);
}

}  // namespace scanloc::sim
