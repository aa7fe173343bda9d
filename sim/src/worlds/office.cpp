#include <algorithm>
#include <vector>

#include "worlds/scene_builder.hpp"

namespace scanloc::sim {
namespace {

using Eigen::Vector2d;

constexpr double kSlab_m = 0.3;
constexpr double kCore_m = 6.0;       // length of the stairwell and its landing, along x
constexpr double kStairs_m = 4.5;     // of it, without the landing
constexpr double kHalfCore_m = 1.6;   // half the width of the stairwell
constexpr double kFlight_m = 0.8;     // of a flight's middle from the axis
constexpr double kCorridor_m = 1.05;  // half the width of the corridor

struct RoomPlan {
  double from_m;
  double to_m;
  double side;  // +1 left of the corridor, -1 right
  double door_at_m;
  bool is_visited;
};

/// The same on all storeys.
struct Plan {
  double length_m;
  double half_depth_m;
  double storey_m;
  std::vector<RoomPlan> rooms;
  bool has_lift;  ///< instead of stairs
};

Plan MakePlan(std::uint64_t seed) {
  Random random(Mix(seed, 0x0FF1CE));
  Plan plan;
  plan.length_m = random.Uniform(36.0, 58.0);
  plan.half_depth_m = random.Uniform(7.0, 9.5);
  plan.storey_m = random.Uniform(3.2, 3.8);
  for (const double side : {1.0, -1.0}) {
    for (double x = kCore_m; x < plan.length_m - 2.5;) {
      double to = x + random.Uniform(2.8, 7.5);
      if (plan.length_m - to < 2.8) to = plan.length_m;
      const double door = random.Uniform(x + 0.8, to - 0.8);
      plan.rooms.push_back({x, to, side, door, random.Chance(0.4)});
      x = to;
    }
  }
  std::ranges::stable_sort(plan.rooms, {}, &RoomPlan::door_at_m);
  plan.has_lift = random.Chance(0.4);
  return plan;
}

/// Down the corridor into some rooms and back; from the landing, or at first from the entrance.
std::vector<Vector2d> Way(const Plan& plan, bool from_entrance) {
  const Vector2d landing(0.5 * (kStairs_m + kCore_m), 0.0);
  std::vector<Vector2d> out = {landing};
  for (const RoomPlan& room : plan.rooms) {
    if (!room.is_visited) continue;
    out.emplace_back(room.door_at_m, 0.0);
    out.emplace_back(room.door_at_m, room.side * std::min(3.6, plan.half_depth_m - 1.6));
    out.emplace_back(room.door_at_m, 0.0);
  }
  const Vector2d end(plan.length_m - 1.2, 0.0);
  out.push_back(end);
  if (!from_entrance) {
    out.push_back(landing);
    return out;
  }
  out.emplace_back(plan.length_m + 14.0, 0.0);
  std::ranges::reverse(out);
  return out;
}

void BuildFloor(const Plan& plan, SceneBuilder* to) {
  const double half = plan.half_depth_m;
  if (plan.has_lift) {
    to->Slab({{0.0, -half}, {plan.length_m, half}}, -kSlab_m, 0.0);
    return;
  }
  to->Slab({{kStairs_m, -half}, {plan.length_m, half}}, -kSlab_m, 0.0);
  to->Slab({{0.0, kHalfCore_m}, {kStairs_m, half}}, -kSlab_m, 0.0);
  to->Slab({{0.0, -half}, {kStairs_m, -kHalfCore_m}}, -kSlab_m, 0.0);
}

/// Two flights to the next storey, with a landing between.
void BuildStairs(const Plan& plan, SceneBuilder* to) {
  constexpr int kNumSteps = 10;
  constexpr double kTread_m = 0.3;
  const double rise = 0.5 * plan.storey_m / kNumSteps;
  for (int i = 0; i < kNumSteps; ++i) {
    const double up = rise * (i + 1);
    const double along = kTread_m * (i + 0.5);
    to->Box({kStairs_m - along, -kFlight_m}, {kTread_m, 1.4}, up - 0.2, up);
    const double upper = 0.5 * plan.storey_m + up;
    to->Box({1.5 + along, kFlight_m}, {kTread_m, 1.4}, upper - 0.2, upper);
  }
  const double middle = 0.5 * plan.storey_m;
  to->Slab({{0.0, -kHalfCore_m}, {1.5, kHalfCore_m}}, middle - 0.2, middle);
}

void WalkStairs(const Plan& plan, SceneBuilder* to) {
  const double middle = 0.5 * plan.storey_m;
  to->WalkTo({kStairs_m, -kFlight_m});
  to->WalkTo({1.5, -kFlight_m}, middle);
  to->WalkTo({0.75, -kFlight_m}, middle);
  to->WalkTo({0.75, kFlight_m}, middle);
  to->WalkTo({1.5, kFlight_m}, middle);
  to->WalkTo({kStairs_m, kFlight_m}, plan.storey_m);
}

/// Open towards the landing: the scans from within it are taken with open doors.
void BuildLift(const Plan& plan, SceneBuilder* to) {
  const double high = plan.storey_m - kSlab_m;
  to->Wall({2.2, -1.1}, {kStairs_m, -1.1}, high);
  to->Wall({2.2, 1.1}, {kStairs_m, 1.1}, high);
  to->Wall({2.2, -1.1}, {2.2, 1.1}, high);
}

void RideLift(const Plan& plan, SceneBuilder* to) {
  to->WalkTo({3.3, 0.0});
  to->WalkTo({3.3, 0.0}, plan.storey_m);
}

void BuildWalls(const Plan& plan, bool has_entrance, SceneBuilder* to) {
  const double high = plan.storey_m - kSlab_m;
  const double half = plan.half_depth_m;
  const double end = plan.length_m;
  to->Wall({0.0, -half}, {end, -half}, high, 0.3);
  to->Wall({0.0, half}, {end, half}, high, 0.3);
  to->Wall({0.0, -half}, {0.0, half}, high + kSlab_m, 0.3);
  if (has_entrance) {
    to->WallWithDoor({end, -half}, {end, half}, half, 1.8, high);
  } else {
    to->Wall({end, -half}, {end, half}, high, 0.3);
  }
  for (const double side : {1.0, -1.0}) {
    to->Wall({0.0, side * kHalfCore_m}, {kStairs_m, side * kHalfCore_m}, high);
    to->Wall({kStairs_m, side * kHalfCore_m}, {kCore_m, side * kHalfCore_m}, high);
    to->Wall({kCore_m, side * kCorridor_m}, {kCore_m, side * half}, high);
  }
  for (const RoomPlan& room : plan.rooms) {
    const double near = room.side * kCorridor_m;
    to->WallWithDoor({room.from_m, near}, {room.to_m, near}, room.door_at_m - room.from_m, 1.0,
                     high);
    if (room.to_m < end) to->Wall({room.to_m, near}, {room.to_m, room.side * half}, high);
  }
}

Rect RectOf(const Plan& plan, const RoomPlan& room) {
  const double near = room.side * (kCorridor_m + 0.1);
  const double far = room.side * (plan.half_depth_m - 0.15);
  return {{room.from_m + 0.08, std::min(near, far)}, {room.to_m - 0.08, std::max(near, far)}};
}

/// Before the entrance, where no two storeys are alike.
void BuildForecourt(const Plan& plan, std::uint64_t seed, SceneBuilder* to) {
  Random random(Mix(seed, 0xF0));
  for (int i = 0; i < 9; ++i) {
    const double side = random.Chance(0.5) ? 1.0 : -1.0;
    const double x = plan.length_m + random.Uniform(3.0, 26.0);
    const double y = side * random.Uniform(2.5, 16.0);
    to->Tree({x, y}, 0.0, random, random.Uniform(0.7, 1.3));
  }
  const double away = random.Uniform(28.0, 40.0);
  const double width = random.Uniform(12.0, 30.0);
  const double aside = random.Uniform(-8.0, 8.0);
  to->Box({plan.length_m + away, aside}, {10.0, width}, 0.0, random.Uniform(6.0, 15.0));
}

}  // namespace

Scene MakeOffice(const SceneOptions& options) {
  const Plan plan = MakePlan(options.seed);
  SceneBuilder builder(options);
  const int num_floors = options.world.num_floors;
  for (int floor = 0; floor < num_floors; ++floor) {
    const std::vector<Vector2d> way = Way(plan, floor == 0);
    builder.BeginStorey(floor * plan.storey_m, way);
    if (floor > 0) BuildFloor(plan, &builder);
    BuildWalls(plan, floor == 0, &builder);
    if (floor == 0) BuildForecourt(plan, options.seed, &builder);
    for (const RoomPlan& room : plan.rooms) {
      const Rect rect = RectOf(plan, room);
      builder.Furnish(rect, 3 + static_cast<int>(rect.area_m2() / 4.0));
    }
    const Rect corridor{{kCore_m, -kCorridor_m}, {plan.length_m, kCorridor_m}};
    builder.Furnish(corridor, 4);
    builder.People({{0.0, -plan.half_depth_m}, {plan.length_m, plan.half_depth_m}}, 6);
    builder.WalkAlong(way);
    if (plan.has_lift) BuildLift(plan, &builder);
    if (floor + 1 == num_floors) break;
    if (plan.has_lift) {
      RideLift(plan, &builder);
    } else {
      BuildStairs(plan, &builder);
      WalkStairs(plan, &builder);
    }
  }
  builder.BeginStorey(num_floors * plan.storey_m, {});
  builder.Slab({{0.0, -plan.half_depth_m}, {plan.length_m, plan.half_depth_m}}, -kSlab_m, 0.0);
  return builder.Finish(options.length_m);
}

}  // namespace scanloc::sim
