#include "worlds/scene_builder.hpp"

#include <array>
#include <cmath>

#include "worlds/walk.hpp"

namespace scanloc::sim {
namespace {

/// A kind of furniture: least and greatest measures [m].
struct Furniture {
  bool at_wall;
  double length_low, length_high;
  double depth_low, depth_high;
  double bottom;
  double height_low, height_high;
};

constexpr std::array<Furniture, 8> kFurniture = {{
    {true, 0.8, 2.0, 0.35, 0.65, 0.0, 1.6, 2.2},    // cupboard, wardrobe
    {true, 0.6, 1.8, 0.25, 0.45, 0.0, 0.7, 1.3},    // sideboard, low shelf
    {true, 1.4, 2.2, 0.8, 1.0, 0.15, 0.6, 0.9},     // bed, sofa
    {true, 1.2, 1.8, 0.7, 0.8, 0.0, 0.72, 1.2},     // desk with what stands on it
    {false, 0.8, 1.8, 0.7, 1.0, 0.68, 0.72, 0.76},  // table top
    {false, 0.45, 0.6, 0.45, 0.6, 0.0, 0.8, 1.1},   // chair
    {false, 0.3, 0.6, 0.3, 0.6, 0.0, 0.3, 0.9},     // box, bin
    {false, 0.4, 0.6, 0.4, 0.6, 0.0, 1.0, 1.8},     // plant, stand
}};

}  // namespace

SceneBuilder::SceneBuilder(const SceneOptions& options)
    : seed_(Mix(options.seed, 0x5CE)),
      session_seed_(Mix(options.session_seed, 0x7E5)),
      changed_share_(options.world.changed_share) {}

void SceneBuilder::BeginStorey(double floor_m, const std::vector<Eigen::Vector2d>& way,
                               double clear_m) {
  floor_m_ = floor_m;
  site_ = Site();
  if (way.size() >= 2) site_.KeepFree(Path(way), clear_m);
}

Solid SceneBuilder::Make(SolidShape shape, const Eigen::Vector2d& center,
                         const Eigen::Vector2d& size, double low_m, double high_m,
                         const Eigen::Vector2d& axis) const {
  Solid solid;
  solid.shape = shape;
  solid.center = center;
  solid.axis = axis;
  solid.half_length_m = 0.5 * size.x();
  solid.half_width_m = 0.5 * size.y();
  solid.z_min_m = floor_m_ + low_m;
  solid.z_max_m = floor_m_ + high_m;
  return solid;
}

void SceneBuilder::Box(const Eigen::Vector2d& center, const Eigen::Vector2d& size, double low_m,
                       double high_m, const Eigen::Vector2d& axis) {
  scene_.solids.push_back(Make(SolidShape::kBox, center, size, low_m, high_m, axis));
}

void SceneBuilder::Round(const Eigen::Vector2d& center, double radius_m, double low_m,
                         double high_m) {
  const Eigen::Vector2d size = Eigen::Vector2d::Constant(2.0 * radius_m);
  scene_.solids.push_back(
      Make(SolidShape::kCylinder, center, size, low_m, high_m, Eigen::Vector2d::UnitX()));
}

void SceneBuilder::Wall(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double high_m,
                        double thickness_m, double low_m) {
  const Eigen::Vector2d along = to - from;
  const double length = std::sqrt(along.x() * along.x() + along.y() * along.y());
  if (length < 0.01) return;
  Box(0.5 * (from + to), {length, thickness_m}, low_m, high_m, along / length);
}

void SceneBuilder::WallWithDoor(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                                double door_at_m, double door_width_m, double high_m) {
  constexpr double kLintel_m = 2.1;
  const Eigen::Vector2d along = to - from;
  const Eigen::Vector2d unit = along / std::sqrt(along.x() * along.x() + along.y() * along.y());
  const Eigen::Vector2d left = from + unit * (door_at_m - 0.5 * door_width_m);
  const Eigen::Vector2d right = from + unit * (door_at_m + 0.5 * door_width_m);
  Wall(from, left, high_m);
  Wall(right, to, high_m);
  if (high_m > kLintel_m) Wall(left, right, high_m, 0.15, kLintel_m);
}

void SceneBuilder::Walls(const Rect& rect, double high_m, double thickness_m) {
  const Eigen::Vector2d a = rect.low;
  const Eigen::Vector2d b(rect.high.x(), rect.low.y());
  const Eigen::Vector2d c = rect.high;
  const Eigen::Vector2d d(rect.low.x(), rect.high.y());
  Wall(a, b, high_m, thickness_m);
  Wall(b, c, high_m, thickness_m);
  Wall(c, d, high_m, thickness_m);
  Wall(d, a, high_m, thickness_m);
}

void SceneBuilder::Tree(const Eigen::Vector2d& at, double ground_m, Random& random, double size) {
  const double trunk_m = size * random.Uniform(2.5, 5.0);
  const double top_m = trunk_m + size * random.Uniform(4.0, 8.0);
  const double radius_m = size * random.Uniform(0.10, 0.24);
  Round(at, radius_m, ground_m - 0.5, trunk_m + ground_m + 1.0);
  const double crown_m = size * random.Uniform(1.2, 2.4);
  Solid crown = Make(SolidShape::kEllipsoid, at, Eigen::Vector2d::Constant(2.0 * crown_m),
                     ground_m + trunk_m, ground_m + top_m, Eigen::Vector2d::UnitX());
  crown.penetration_m = random.Uniform(1.0, 3.5);
  scene_.solids.push_back(crown);
}

Random SceneBuilder::NextThing(double changed_share) {
  const std::uint64_t thing = ++num_things_;
  // Each session has its own exceptions: the share is of what differs between two of them.
  const double changed = 1.0 - std::sqrt(1.0 - changed_share);
  const std::uint64_t own = Mix(Mix(seed_, session_seed_), thing);
  return Random(UnitInterval(Mix(own, 1)) < changed ? own : Mix(seed_, thing));
}

bool SceneBuilder::PutLoose(const Eigen::Vector2d& center, const Eigen::Vector2d& size,
                            double low_m, double high_m, const Eigen::Vector2d& axis, bool round) {
  const Solid solid =
      Make(round ? SolidShape::kCylinder : SolidShape::kBox, center, size, low_m, high_m, axis);
  if (!site_.Fits(solid, 0.02)) return false;
  site_.Take(solid);
  scene_.solids.push_back(solid);
  return true;
}

void SceneBuilder::Furnish(const Rect& room, int count) {
  for (int i = 0; i < count; ++i) {
    Random random = NextThing();
    const Furniture& kind = kFurniture[static_cast<std::size_t>(random.Index(kFurniture.size()))];
    const double length = random.Uniform(kind.length_low, kind.length_high);
    const double depth = random.Uniform(kind.depth_low, kind.depth_high);
    const double height = random.Uniform(kind.height_low, kind.height_high);
    const int side = random.Index(4);
    const double along = random.Uniform(0.0, 1.0);
    const double across = random.Uniform(0.0, 1.0);
    const bool turned = kind.at_wall ? side % 2 == 1 : random.Chance(0.5);
    const Eigen::Vector2d size = turned ? Eigen::Vector2d(depth, length)  //
                                        : Eigen::Vector2d(length, depth);
    const Eigen::Vector2d gap = Eigen::Vector2d::Constant(0.12) + 0.5 * size;
    const Eigen::Vector2d low = room.low + gap;
    const Eigen::Vector2d high = room.high - gap;
    if (low.x() > high.x() || low.y() > high.y()) continue;
    Eigen::Vector2d at(low.x() + (high.x() - low.x()) * along,
                       low.y() + (high.y() - low.y()) * across);
    if (kind.at_wall && side == 0) at.y() = low.y();
    if (kind.at_wall && side == 1) at.x() = high.x();
    if (kind.at_wall && side == 2) at.y() = high.y();
    if (kind.at_wall && side == 3) at.x() = low.x();
    PutLoose(at, size, kind.bottom, height);
  }
}

void SceneBuilder::People(const Rect& where, int count) {
  for (int i = 0; i < count; ++i) {
    Random random = NextThing(1.0);
    const double x = random.Uniform(where.low.x(), where.high.x());
    const double y = random.Uniform(where.low.y(), where.high.y());
    const double width = random.Uniform(0.36, 0.56);
    PutLoose({x, y}, {width, width}, 0.0, random.Uniform(1.5, 1.95), Eigen::Vector2d::UnitX(),
             true);
  }
}

void SceneBuilder::Car(const Eigen::Vector2d& at, const Eigen::Vector2d& axis, Random& random) {
  const double length = random.Uniform(3.9, 4.9);
  const double width = random.Uniform(1.65, 1.95);
  const bool tall = random.Chance(0.35);
  const double bonnet = random.Uniform(0.8, 1.05);
  const double cabin = length * (tall ? random.Uniform(0.6, 0.75) : random.Uniform(0.45, 0.55));
  const double back = random.Uniform(0.1, 0.5);
  if (!PutLoose(at, {length, width}, 0.22, bonnet, axis)) return;
  Box(at - axis * back, {cabin, width - 0.2}, bonnet, tall ? 1.8 : 1.45, axis);
}

void SceneBuilder::WalkTo(const Eigen::Vector2d& at, double above_floor_m) {
  const Eigen::Vector3d next(at.x(), at.y(), floor_m_ + above_floor_m);
  if (!scene_.walk.empty() && (scene_.walk.back() - next).squaredNorm() < 1e-6) return;
  scene_.walk.push_back(next);
}

void SceneBuilder::WalkAlong(const std::vector<Eigen::Vector2d>& way) {
  for (const Eigen::Vector2d& at : way) WalkTo(at);
}

Scene SceneBuilder::Finish(double length_m) {
  double length = 0.0;
  for (std::size_t i = 0; i + 1 < scene_.walk.size(); ++i) {
    const Eigen::Vector3d step = scene_.walk[i + 1] - scene_.walk[i];
    const double step_m = WayOf(step);
    if (length + step_m >= length_m) {
      scene_.walk[i + 1] = scene_.walk[i] + step * ((length_m - length) / step_m);
      scene_.walk.resize(i + 2);
      break;
    }
    length += step_m;
  }
  return std::move(scene_);
}

}  // namespace scanloc::sim
