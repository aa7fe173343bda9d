#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "worlds/scene_builder.hpp"

// A campus and a forest.

namespace scanloc::sim {
namespace {

using Eigen::Vector2d;

constexpr double kMargin_m = 60.0;  // of what stands beyond the way

Rect Around(const std::vector<Vector2d>& way, double margin_m) {
  Rect rect{way.front(), way.front()};
  for (const Vector2d& at : way) {
    rect.low = rect.low.cwiseMin(at);
    rect.high = rect.high.cwiseMax(at);
  }
  rect.low.array() -= margin_m;
  rect.high.array() += margin_m;
  return rect;
}

/// Hills of long waves.
Ground MakeHills(const Rect& rect, double steepness, Random random) {
  std::array<Ground::Wave, 6> waves{};
  for (Ground::Wave& wave : waves) {
    const double length = random.Uniform(60.0, 300.0);
    wave.number = CosSin(random.Uniform(0.0, 6.28)) * (6.283185307179586 / length);
    wave.phase = random.Uniform(0.0, 6.28);
    wave.height_m = length * steepness * random.Uniform(0.3, 1.0);
  }
  Ground ground(rect.low, rect.high);
  ground.Shape(waves);
  return ground;
}

/// The surface: the whole ground is raised above the streets' level.
double Surface(const Ground& ground, const Vector2d& at) {
  return ground.Height(at.x(), at.y()) + Ground::kKerb_m;
}

/// The way follows the ground; its points are close enough together for that.
void WalkOver(const Ground& ground, const std::vector<Vector2d>& way, SceneBuilder* to) {
  constexpr double kStep_m = 2.0;
  const Path path(way);
  for (double along = 0.0;; along += kStep_m) {
    const Vector2d at = path.At(along);
    to->WalkTo(at, Surface(ground, at));
    if (along >= path.length_m()) break;
  }
}

double DistanceTo(const std::vector<Vector2d>& way, const Vector2d& point) {
  double best2 = 1e18;
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    const Vector2d along = way[i + 1] - way[i];
    const double t = std::clamp((point - way[i]).dot(along) / along.squaredNorm(), 0.0, 1.0);
    best2 = std::min(best2, (way[i] + along * t - point).squaredNorm());
  }
  return std::sqrt(best2);
}

std::vector<Vector2d> WindingWay(double length_m, Random random) {
  constexpr double kStep_m = 8.0;
  std::vector<Vector2d> way = {Vector2d::Zero()};
  double heading_rad = random.Uniform(0.0, 6.28);
  double bend_rad = 0.0;
  for (double along = 0.0; along < length_m; along += kStep_m) {
    if (random.Chance(0.35)) bend_rad = random.Uniform(-0.25, 0.25);
    heading_rad += bend_rad;
    way.emplace_back(way.back() + CosSin(heading_rad) * kStep_m);
  }
  return way;
}

/// Of the blocks between the paths of a campus.
struct Blocks {
  Vector2d size;
  int num;
};

/// From crossing to crossing, never straight back.
std::vector<Vector2d> WayRoundBlocks(const Blocks& blocks, double length_m, Random random) {
  std::vector<Vector2d> way;
  Eigen::Vector2i at(blocks.num / 2, blocks.num / 2);
  Eigen::Vector2i last(1, 0);
  double length = 0.0;
  way.emplace_back(at.cast<double>().cwiseProduct(blocks.size));
  while (length < length_m) {
    const std::array<Eigen::Vector2i, 3> turns = {last, Eigen::Vector2i(-last.y(), last.x()),
                                                  Eigen::Vector2i(last.y(), -last.x())};
    const Eigen::Vector2i step = turns[static_cast<std::size_t>(random.Index(3))];
    const Eigen::Vector2i next = at + step;
    if (next.minCoeff() < 0 || next.maxCoeff() > blocks.num) continue;
    length += step.x() != 0 ? blocks.size.x() : blocks.size.y();
    at = next;
    last = step;
    way.emplace_back(at.cast<double>().cwiseProduct(blocks.size));
  }
  return way;
}

/// A building of one or two wings in the middle of a block, and what stands on its lawn.
void BuildBlock(const Rect& block, const Ground& ground, Random random, SceneBuilder* to) {
  const Vector2d room = block.size() - Vector2d::Constant(16.0);
  const double base = Surface(ground, block.center());
  const double height = random.Uniform(5.0, 22.0);
  const Vector2d size(room.x() * random.Uniform(0.3, 0.85), room.y() * random.Uniform(0.25, 0.6));
  const double x = random.Uniform(-0.4, 0.4) * (room.x() - size.x());
  const double y = random.Uniform(-0.4, 0.4) * (room.y() - size.y());
  const Vector2d at = block.center() + Vector2d(x, y);
  if (random.Chance(0.85)) {
    to->Box(at, size, base - 2.0, base + height);
    if (random.Chance(0.6)) {
      const double wing = random.Uniform(8.0, 14.0);
      const double end = random.Chance(0.5) ? 0.5 : -0.5;
      const double long_m = room.y() * random.Uniform(0.4, 0.9);
      to->Box(at + Vector2d(end * (size.x() - wing), 0.0), {wing, long_m}, base - 2.0,
              base + height * random.Uniform(0.6, 1.0));
    }
    const double entrance = random.Uniform(-0.4, 0.4) * size.x();
    to->Box(at + Vector2d(entrance, -0.5 * size.y() - 1.2), {4.0, 2.4}, base + 2.6, base + 3.0);
  }
  const int num_trees = random.Index(14);
  for (int i = 0; i < num_trees; ++i) {
    const double tx = random.Uniform(block.low.x() + 3.5, block.high.x() - 3.5);
    const double ty = random.Uniform(block.low.y() + 3.5, block.high.y() - 3.5);
    to->Tree({tx, ty}, Surface(ground, {tx, ty}), random, random.Uniform(0.7, 1.6));
  }
}

void FurnishPaths(const std::vector<Vector2d>& way, const Ground& ground, std::uint64_t seed,
                  SceneBuilder* to) {
  Random random(Mix(seed, 0xFA));
  const double lamps = random.Uniform(16.0, 26.0);
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    const Vector2d along = way[i + 1] - way[i];
    const double length = std::sqrt(along.squaredNorm());
    const Vector2d axis = along / length;
    const auto base = [&](const Vector2d& at) { return Surface(ground, at); };
    for (double s = random.Uniform(3.0, lamps); s < length - 3.0; s += lamps) {
      const Vector2d at = way[i] + axis * s + LeftOf(axis) * 2.2;
      to->Round(at, 0.07, base(at) - 0.5, base(at) + 4.5);
    }
    for (double s = 4.0; s < length - 4.0; s += random.Uniform(6.0, 14.0)) {
      Random thing = to->NextThing();
      const double side = thing.Chance(0.5) ? 1.0 : -1.0;
      const Vector2d at = way[i] + axis * s + LeftOf(axis) * (side * thing.Uniform(2.4, 3.4));
      const double kind = thing.Uniform(0.0, 1.0);
      const double high = thing.Uniform(0.8, 1.3);
      if (kind < 0.3) to->PutLoose(at, {1.8, 0.5}, base(at), base(at) + 0.85, axis);  // bench
      if (kind >= 0.3 && kind < 0.6) {                                                // bicycles
        to->PutLoose(at, {thing.Uniform(1.5, 6.0), 0.6}, base(at), base(at) + high, axis);
      }
      if (kind >= 0.6 && kind < 0.8) {  // hedge
        to->PutLoose(at, {thing.Uniform(2.0, 8.0), 0.8}, base(at) - 0.3, base(at) + high, axis);
      }
    }
    to->People(
        {way[i].cwiseMin(way[i + 1]).array() - 4.0, way[i].cwiseMax(way[i + 1]).array() + 4.0}, 2);
  }
}

}  // namespace

Scene MakeCampus(const SceneOptions& options) {
  Random random(Mix(options.seed, 0xCA));
  Blocks blocks;
  blocks.size = {random.Uniform(55.0, 95.0), 0.0};
  blocks.size.y() = random.Uniform(45.0, 80.0);
  const double half_blocks = options.length_m / (4.0 * blocks.size.y());
  blocks.num = std::clamp(static_cast<int>(std::sqrt(2.0 * half_blocks)) + 1, 2, 20);
  const std::vector<Vector2d> way =
      WayRoundBlocks(blocks, options.length_m, Random(Mix(options.seed, 0xCB)));
  const Rect rect{Vector2d::Constant(-kMargin_m - 20.0),
                  blocks.size * blocks.num + Vector2d::Constant(kMargin_m + 20.0)};
  SceneBuilder builder(options);
  builder.scene().ground = MakeHills(rect, 0.003, Random(Mix(options.seed, 0xCC)));
  const Ground ground = builder.scene().ground;
  builder.BeginStorey(0.0, way, 0.9);
  for (int row = -1; row <= blocks.num; ++row) {
    for (int column = -1; column <= blocks.num; ++column) {
      const Vector2d low = Vector2d(column, row).cwiseProduct(blocks.size);
      const std::uint64_t number = static_cast<std::uint64_t>(row + 1) * 64 + column + 1;
      BuildBlock({low, low + blocks.size}, ground, Random(Mix(Mix(options.seed, 0xCD), number)),
                 &builder);
    }
  }
  FurnishPaths(way, ground, options.seed, &builder);
  WalkOver(ground, way, &builder);
  return builder.Finish(options.length_m);
}

Scene MakeForest(const SceneOptions& options) {
  Random random(Mix(options.seed, 0xF0E));
  const std::vector<Vector2d> way =
      WindingWay(options.length_m + 8.0, Random(Mix(options.seed, 0xF1)));
  constexpr double kDeep_m = 35.0;
  const Rect rect = Around(way, kDeep_m + 20.0);
  SceneBuilder builder(options);
  builder.scene().ground = MakeHills(rect, 0.012, Random(Mix(options.seed, 0xF2)));
  const Ground ground = builder.scene().ground;
  builder.BeginStorey(0.0, way, 1.2);
  const double spacing = random.Uniform(3.2, 5.0);
  const double size = random.Uniform(0.8, 1.5);
  for (double x = rect.low.x() + 20.0; x < rect.high.x() - 20.0; x += spacing) {
    for (double y = rect.low.y() + 20.0; y < rect.high.y() - 20.0; y += spacing) {
      const double at_x = x + random.Uniform(-0.45, 0.45) * spacing;
      const double at_y = y + random.Uniform(-0.45, 0.45) * spacing;
      const Vector2d at(at_x, at_y);
      const std::uint64_t own = random.Next();
      const double away = DistanceTo(way, at);
      if (away > kDeep_m) continue;
      Random tree(own);
      const double base = Surface(ground, at);
      if (away > 1.8 && tree.Chance(0.75)) {
        builder.Tree(at, base, tree, size * tree.Uniform(0.6, 1.3));
      }
      Random thing = builder.NextThing();
      if (!thing.Chance(0.25)) continue;
      const double bush_x = at.x() + thing.Uniform(-1.0, 1.0);
      const double bush_y = at.y() + thing.Uniform(-1.0, 1.0);
      const double width = thing.Uniform(0.4, 2.0);
      builder.PutLoose({bush_x, bush_y}, {width, width}, base - 0.3, base + thing.Uniform(0.3, 1.5),
                       Vector2d::UnitX(), true);
    }
  }
  WalkOver(ground, way, &builder);
  return builder.Finish(options.length_m);
}

}  // namespace scanloc::sim
