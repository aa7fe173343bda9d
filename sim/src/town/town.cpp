#include "scanloc/sim/town.hpp"

#include <array>

#include "sim_text.hpp"
#include "town/town_builder.hpp"
#include "town/town_network.hpp"

namespace scanloc::sim {
namespace {

constexpr double kSurroundings_m = 120.0;  // beyond the outermost streets

/// A sum of long waves: slopes of a few per cent, and no two places quite alike.
Ground MakeGround(const std::vector<Street>& streets, Random random) {
  Eigen::Vector2d lower = streets.front().center.points().front();
  Eigen::Vector2d upper = lower;
  for (const Street& street : streets) {
    for (const Eigen::Vector2d& point : street.center.points()) {
      lower = lower.cwiseMin(point);
      upper = upper.cwiseMax(point);
    }
  }
  const Eigen::Vector2d margin(kSurroundings_m, kSurroundings_m);
  Ground ground(lower - margin, upper + margin);

  struct Wave {
    Eigen::Vector2d number;  // radians a metre
    double phase;
    double height_m;
  };
  std::array<Wave, 5> waves{};
  for (Wave& wave : waves) {
    const double length = random.Uniform(180.0, 700.0);
    wave.number = CosSin(random.Uniform(0.0, 6.28)) * (6.283185307179586 / length);
    wave.phase = random.Uniform(0.0, 6.28);
    wave.height_m = length * random.Uniform(0.0005, 0.0018);
  }
  for (int row = 0; row < ground.num_rows(); ++row) {
    for (int column = 0; column < ground.num_columns(); ++column) {
      const Eigen::Vector2d at =
          ground.lower() + Eigen::Vector2d(column, row) * Ground::kTerrainCell_m;
      double height = 0.0;
      for (const Wave& wave : waves) {
        height += wave.height_m * CosSin(at.dot(wave.number) + wave.phase).y();
      }
      ground.SetHeight(column, row, height);
    }
  }
  for (const Street& street : streets) ground.CarveStreet(street.center, street.kerb_half_m);
  return ground;
}

}  // namespace

absl::Status Validate(const TownOptions& options) {
  return CheckRange("length_m", options.length_m, 20, 100'000);
}

absl::StatusOr<Town> MakeTown(const TownOptions& options) {
  if (auto s = Validate(options); !s.ok()) return s;
  const std::uint64_t seed = Mix(options.town_seed, 0x70);
  Network network = MakeNetwork(options.length_m, Random(Mix(seed, 1)));
  Town town;
  town.options = options;
  town.ground = MakeGround(network.streets, Random(Mix(seed, 2)));
  TownBuilder builder(town, network);
  for (std::size_t i = 0; i < network.streets.size(); ++i) {
    for (const double side : {1.0, -1.0}) {
      const std::uint64_t side_seed = Mix(Mix(seed, 3), 2 * i + (side > 0.0 ? 0 : 1));
      builder.BuildSide({&network.streets[i], side}, network.classes[i], Random(side_seed));
    }
  }
  town.streets = std::move(network.streets);
  town.route = std::move(network.route);
  return town;
}

}  // namespace scanloc::sim
