#include <cmath>
#include <vector>

#include "worlds/scene_builder.hpp"

namespace scanloc::sim {
namespace {

using Eigen::Vector2d;

constexpr double kStep_m = 5.0;  // of the pieces that its curve is made of

/// The middle line, with a curvature that changes slowly.
std::vector<Vector2d> MakeLine(double length_m, Random random) {
  std::vector<Vector2d> line = {Vector2d::Zero()};
  Vector2d heading = Vector2d::UnitX();
  double bend = 0.0;
  for (double along = 0.0; along < length_m; along += kStep_m) {
    if (random.Chance(0.1)) bend = random.Uniform(-0.02, 0.02);
    const Vector2d turn = CosSin(bend);
    heading = Vector2d(heading * turn.x() + LeftOf(heading) * turn.y());
    line.emplace_back(line.back() + heading * kStep_m);
  }
  return line;
}

}  // namespace

Scene MakeTunnel(const SceneOptions& options) {
  Random random(Mix(options.seed, 0x7E1));
  const double half = random.Uniform(4.2, 5.5);
  const double high = random.Uniform(4.6, 6.0);
  const double niche_every = kStep_m * (8 + random.Index(5));
  const double exit_every = niche_every * (2 + random.Index(3));
  const double fan_every = random.Uniform(60.0, 110.0);
  const std::vector<Vector2d> line = MakeLine(options.length_m, Random(Mix(options.seed, 0x71)));

  SceneBuilder builder(options);
  builder.BeginStorey(0.0, line, 1.8);
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const double along = kStep_m * static_cast<double>(i);
    const Vector2d axis = (line[i + 1] - line[i]) / kStep_m;
    const Vector2d left = LeftOf(axis);
    const Vector2d middle = 0.5 * (line[i] + line[i + 1]);
    const bool is_niche = std::fmod(along, niche_every) < 0.5 * kStep_m;
    const bool is_exit = std::fmod(along, exit_every) < 0.5 * kStep_m;
    for (const double side : {1.0, -1.0}) {
      const bool is_open = (is_niche && side > 0.0) || (is_exit && side < 0.0);
      const double away = half + (is_open ? 1.6 : 0.15);
      builder.Box(middle + left * (side * away), {kStep_m + 0.3, 0.3}, 0.0, high, axis);
      if (is_open) {
        for (const double end : {-0.5 * kStep_m, 0.5 * kStep_m}) {
          builder.Box(middle + axis * end + left * (side * (half + 0.8)), {0.2, 1.6}, 0.0, high,
                      axis);
        }
        builder.Box(middle + left * (side * (half + 1.0)), {0.8, 0.5}, 0.0, 1.9, axis);
      }
      // A raised walkway, a cable tray.
      builder.Box(middle + left * (side * (half - 0.4)), {kStep_m + 0.2, 0.8}, 0.0, 0.25, axis);
      builder.Box(middle + left * (side * (half - 0.1)), {kStep_m, 0.25}, high - 1.2, high - 1.0,
                  axis);
    }
    builder.Box(middle, {kStep_m + 0.4, 2.0 * half + 4.0}, high, high + 0.4, axis);
    if (std::fmod(along, fan_every) < kStep_m) {
      builder.Box(middle, {3.2, 1.1}, high - 1.3, high - 0.2, axis);
    }
    // What was added over the years.
    if (random.Chance(0.08)) {
      const double side = random.Chance(0.5) ? 1.0 : -1.0;
      const double length = random.Uniform(0.4, 1.5);
      const double depth = random.Uniform(0.25, 0.5);
      const double aside = half - 0.5 * depth;
      builder.Box(middle + left * (side * aside), {length, depth}, 0.25, random.Uniform(0.9, 2.1),
                  axis);
    }
    Random vehicle = builder.NextThing(1.0);
    if (vehicle.Chance(0.12)) {
      const bool ahead = vehicle.Chance(0.5);
      builder.Car(middle + left * (ahead ? 2.9 : -2.9), ahead ? Vector2d(-axis) : axis, vehicle);
    }
  }
  builder.WalkAlong(line);
  return builder.Finish(options.length_m);
}

}  // namespace scanloc::sim
