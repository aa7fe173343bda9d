#include <algorithm>
#include <array>
#include <vector>

#include "worlds/scene_builder.hpp"

// A flat, one room of it, a room around a corner, and a hall.

namespace scanloc::sim {
namespace {

using Eigen::Vector2d;

constexpr double kDoor_m = 0.9;
constexpr double kHigh_m = 2.6;

/// Two rooms that a door joins.
struct Doorway {
  std::size_t a, b;
  Vector2d from, to;  // the wall between them
  double at_m;        // of the door's middle along the wall
};

struct Flat {
  Vector2d size;
  std::vector<Rect> rooms;
  std::vector<Doorway> doors;
  std::vector<std::pair<Vector2d, Vector2d>> walls;  // those without a door
};

/// What two rooms have in common of the line at `cut`, along the other axis.
std::pair<double, double> Shared(const Rect& a, const Rect& b, int axis) {
  return {std::max(a.low[axis], b.low[axis]), std::min(a.high[axis], b.high[axis])};
}

/// Splits a room, and the halves, as long as they are large; returns the rooms that are left.
std::vector<std::size_t> Split(const Rect& rect, Random& random, Flat* flat) {
  const int axis = rect.size().x() > rect.size().y() ? 0 : 1;
  const int other = 1 - axis;
  if (rect.size()[axis] < 5.0 || (rect.area_m2() < 22.0 && random.Chance(0.7))) {
    flat->rooms.push_back(rect);
    return {flat->rooms.size() - 1};
  }
  const double cut = rect.low[axis] + rect.size()[axis] * random.Uniform(0.38, 0.62);
  Rect below = rect;
  Rect above = rect;
  below.high[axis] = cut;
  above.low[axis] = cut;
  std::vector<std::size_t> rooms = Split(below, random, flat);
  const std::vector<std::size_t> others = Split(above, random, flat);
  // One door, where two rooms have enough wall in common.
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const std::size_t a : rooms) {
    for (const std::size_t b : others) {
      if (flat->rooms[a].high[axis] != cut || flat->rooms[b].low[axis] != cut) continue;
      pairs.emplace_back(a, b);
    }
  }
  const auto shared_m = [&](const std::pair<std::size_t, std::size_t>& pair) {
    const auto [low, high] = Shared(flat->rooms[pair.first], flat->rooms[pair.second], other);
    return high - low;
  };
  const auto [a, b] = *std::ranges::max_element(
      pairs, [&](const auto& left, const auto& right) { return shared_m(left) < shared_m(right); });
  const auto [low, high] = Shared(flat->rooms[a], flat->rooms[b], other);
  Doorway door{a, b, {}, {}, 0.0};
  door.from[axis] = door.to[axis] = cut;
  door.from[other] = rect.low[other];
  door.to[other] = rect.high[other];
  const double half = 0.5 * kDoor_m + 0.2;
  door.at_m = random.Uniform(low + half, high - half) - rect.low[other];
  flat->doors.push_back(door);
  rooms.insert(rooms.end(), others.begin(), others.end());
  return rooms;
}

Vector2d DoorPoint(const Doorway& door) {
  const Vector2d along = door.to - door.from;
  return door.from + along * (door.at_m / std::max(std::abs(along.x()), std::abs(along.y())));
}

/// Into every room, round in it, and back.
void Tour(const Flat& flat, std::size_t room, std::size_t from_door, std::vector<Vector2d>* way) {
  const Rect& rect = flat.rooms[room];
  const Vector2d middle = rect.center();
  const Vector2d quarter = 0.22 * rect.size();
  way->push_back(middle);
  for (const Vector2d& corner : {Vector2d(1, 1), Vector2d(-1, 1), Vector2d(-1, -1)}) {
    way->push_back(middle + quarter.cwiseProduct(corner));
  }
  way->push_back(middle);
  for (std::size_t i = 0; i < flat.doors.size(); ++i) {
    const Doorway& door = flat.doors[i];
    if (i == from_door || (door.a != room && door.b != room)) continue;
    const std::size_t next = door.a == room ? door.b : door.a;
    way->push_back(DoorPoint(door));
    Tour(flat, next, i, way);
    way->push_back(DoorPoint(door));
    way->push_back(middle);
  }
}

void BuildShell(const Vector2d& size, double high, Random random, SceneBuilder* to) {
  const Rect rect{Vector2d::Zero(), size};
  to->Walls(rect, high);
  to->Slab(rect, high, high + 0.3);
  // What is built in makes the corners differ: a chimney breast, a pillar, a duct.
  const int count = 1 + random.Index(3);
  for (int i = 0; i < count; ++i) {
    const int corner = random.Index(4);
    const double length = random.Uniform(0.3, 1.1);
    const double depth = random.Uniform(0.25, 0.7);
    const double x = (corner & 1) != 0 ? size.x() - 0.5 * length : 0.5 * length;
    const double y = (corner & 2) != 0 ? size.y() - 0.5 * depth : 0.5 * depth;
    to->Box({x, y}, {length, depth}, 0.0, random.Chance(0.8) ? high : random.Uniform(0.9, 2.2));
  }
}

}  // namespace

Scene MakeHome(const SceneOptions& options) {
  Random random(Mix(options.seed, 0x40E));
  Flat flat;
  flat.size = {random.Uniform(9.0, 13.0), 0.0};
  flat.size.y() = random.Uniform(7.0, 10.0);
  Split({Vector2d::Zero(), flat.size}, random, &flat);
  std::vector<Vector2d> way;
  Tour(flat, 0, flat.doors.size(), &way);

  SceneBuilder builder(options);
  builder.BeginStorey(0.0, way, 0.35);
  BuildShell(flat.size, kHigh_m, Random(Mix(options.seed, 0x54E)), &builder);
  for (const Doorway& door : flat.doors) {
    builder.WallWithDoor(door.from, door.to, door.at_m, kDoor_m, kHigh_m);
  }
  for (const Rect& room : flat.rooms) {
    builder.Furnish(room, 4 + static_cast<int>(room.area_m2() / 2.5));
  }
  builder.People({Vector2d::Zero(), flat.size}, 2);
  builder.WalkAlong(way);
  return builder.Finish(options.length_m);
}

Scene MakeRoom(const SceneOptions& options) {
  Random random(Mix(options.seed, 0x400));
  const double length = random.Uniform(4.5, 10.0);
  const Vector2d size(length, length * random.Uniform(0.6, 0.9));
  const double high = random.Uniform(2.4, 3.4);
  std::vector<Vector2d> way;
  for (const double inset : {0.3, 0.42, 0.2}) {
    const Vector2d low = size * inset;
    const Vector2d far = size - low;
    way.insert(way.end(), {low, {far.x(), low.y()}, far, {low.x(), far.y()}, low});
  }
  SceneBuilder builder(options);
  builder.BeginStorey(0.0, way, 0.35);
  BuildShell(size, high, Random(Mix(options.seed, 0x54E)), &builder);
  builder.Furnish({Vector2d::Zero(), size}, 6 + static_cast<int>(size.x() * size.y() / 3.0));
  builder.People({Vector2d::Zero(), size}, 1);
  builder.WalkAlong(way);
  return builder.Finish(options.length_m);
}

/// A room around a corner: a rectangle without another at one of its corners.
Scene MakeCornerRoom(const SceneOptions& options) {
  Random random(Mix(options.seed, 0xC04));
  const Vector2d size(random.Uniform(5.0, 10.0), random.Uniform(5.0, 8.0));
  const Vector2d arms =
      size.cwiseProduct(Vector2d(random.Uniform(0.4, 0.6), random.Uniform(0.4, 0.6)));
  const double high = random.Uniform(2.4, 3.4);
  const Rect along_x{Vector2d::Zero(), {size.x(), arms.y()}};
  const Rect along_y{{0.0, arms.y()}, {arms.x(), size.y()}};
  const auto way_up_to = [&](double wall_m) {
    std::vector<Vector2d> way;
    for (const double inset : {0.5, 0.35, 0.65}) {
      const Vector2d corner = inset * arms;
      const Vector2d end = size - Vector2d::Constant(wall_m);
      way.insert(way.end(), {corner, {end.x(), corner.y()}, corner, {corner.x(), end.y()}, corner});
    }
    return way;
  };
  SceneBuilder builder(options);
  builder.BeginStorey(0.0, way_up_to(0.4), 0.35);  // who turns needs room, too
  const std::array<Vector2d, 6> corners = {Vector2d::Zero(),
                                           Vector2d(size.x(), 0.0),
                                           Vector2d(size.x(), arms.y()),
                                           arms,
                                           Vector2d(arms.x(), size.y()),
                                           Vector2d(0.0, size.y())};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    builder.Wall(corners[i], corners[(i + 1) % corners.size()], high, 0.2);
  }
  for (const Rect& part : {along_x, along_y}) {
    builder.Slab(part, high, high + 0.3);
    builder.Furnish(part, 3 + static_cast<int>(part.area_m2() / 3.0));
  }
  builder.People(along_x, 1);
  builder.WalkAlong(way_up_to(0.8));
  return builder.Finish(options.length_m);
}

Scene MakeHall(const SceneOptions& options) {
  Random random(Mix(options.seed, 0x4A1));
  const Vector2d size(random.Uniform(8.0, 26.0), random.Uniform(6.0, 16.0));
  const double high = random.Uniform(3.0, 6.0);
  std::vector<Vector2d> way;
  for (double y = 1.2; y < size.y() - 1.0; y += 1.6) {
    const bool out = way.size() % 4 == 0;
    way.emplace_back(out ? 1.2 : size.x() - 1.2, y);
    way.emplace_back(out ? size.x() - 1.2 : 1.2, y);
  }
  SceneBuilder builder(options);
  builder.BeginStorey(0.0, way, 0.3);
  const Rect hall{Vector2d::Zero(), size};
  builder.Walls(hall, high);
  builder.Slab(hall, high, high + 0.3);
  // Everything built has its mirror image across the centre.
  const int num_pairs = 2 + random.Index(4);
  for (int i = 0; i < num_pairs; ++i) {
    const double x = random.Uniform(0.15, 0.85) * size.x();
    const bool is_column = random.Chance(0.5);
    const double y = is_column ? 0.4 : random.Uniform(0.2, 0.4);
    const Vector2d extent =
        is_column ? Vector2d(0.4, 0.4) : Vector2d(random.Uniform(0.8, 2.0), 0.4);
    const double top = is_column ? high : random.Uniform(0.8, 2.2);
    builder.Box({x, y}, extent, 0.0, top);
    builder.Box(size - Vector2d(x, y), extent, 0.0, top);
  }
  builder.Furnish({Vector2d::Zero(), size}, 2 + random.Index(3));
  builder.WalkAlong(way);
  return builder.Finish(options.length_m);
}

}  // namespace scanloc::sim
