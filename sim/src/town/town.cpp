#include "scanloc/sim/town.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "scanloc/core/status_macros.hpp"
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

  std::array<Ground::Wave, 5> waves{};
  for (Ground::Wave& wave : waves) {
    const double length = random.Uniform(180.0, 700.0);
    wave.number = CosSin(random.Uniform(0.0, 6.28)) * (6.283185307179586 / length);
    wave.phase = random.Uniform(0.0, 6.28);
    wave.height_m = length * random.Uniform(0.0005, 0.0018);
  }
  ground.Shape(waves);
  for (const Street& street : streets) ground.CarveStreet(street.center, street.kerb_half_m);
  return ground;
}

/// How much of the route goes along each street [m].
std::vector<double> DrivenLengths(const Town& town) {
  constexpr double kOnStreet_m = 4.0;
  constexpr std::size_t kEvery = 4;  // points of a street
  std::vector<double> lengths(town.streets.size(), 0.0);
  for (const Eigen::Vector2d& at : town.route.points()) {
    for (std::size_t i = 0; i < town.streets.size(); ++i) {
      const std::vector<Eigen::Vector2d>& center = town.streets[i].center.points();
      bool is_on = false;
      for (std::size_t k = 0; k < center.size() && !is_on; k += kEvery) {
        is_on = (center[k] - at).squaredNorm() < kOnStreet_m * kOnStreet_m;
      }
      if (!is_on) continue;
      lengths[i] += Path::kStep_m;
      break;
    }
  }
  return lengths;
}

/// Which streets are torn down: in an order of their own, until they are share enough.
std::vector<bool> ChooseRebuilt(const Town& town) {
  const std::vector<double> lengths = DrivenLengths(town);
  const double wanted_m = town.options.rebuilt_share * town.route.length_m();
  std::vector<std::size_t> order(lengths.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::uint64_t seed = Mix(town.options.town_seed, town.options.rebuilt_seed);
  std::ranges::sort(order,
                    [&](std::size_t a, std::size_t b) { return Mix(seed, a) < Mix(seed, b); });
  std::vector<bool> is_rebuilt(lengths.size(), false);
  double sum_m = 0.0;
  for (const std::size_t i : order) {
    if (sum_m >= wanted_m) break;
    is_rebuilt[i] = lengths[i] > 0.0;
    sum_m += lengths[i];
  }
  return is_rebuilt;
}

/// What stands in a town, side by side of its streets.
class Frontages {
 public:
  Frontages(Town& town, const Network& network, std::uint64_t seed)
      : town_(town), network_(network), seed_(seed) {}

  void BuildAll() {
    TownBuilder builder(town_, network_);
    for (std::size_t i = 0; i < town_.streets.size(); ++i) {
      begins_.push_back({town_.fixed.size(), town_.changeable.size(), town_.parking.size()});
      BuildSides(builder, i, seed_);
    }
    begins_.push_back({town_.fixed.size(), town_.changeable.size(), town_.parking.size()});
  }

  /// Tears the sides of some streets down and builds them anew; the rest stays as it is.
  void Rebuild(const std::vector<bool>& is_rebuilt) {
    TearDown(town_.fixed, 0, is_rebuilt);
    TearDown(town_.changeable, 1, is_rebuilt);
    TearDown(town_.parking, 2, is_rebuilt);
    TownBuilder builder(town_, network_);
    for (const Solid& solid : town_.fixed) builder.KeepClearOf(solid);
    for (std::size_t i = 0; i < is_rebuilt.size(); ++i) {
      if (!is_rebuilt[i]) continue;
      BuildSides(builder, i, Mix(seed_, town_.options.rebuilt_seed));
      town_.rebuilt.push_back(town_.streets[i].center);
    }
  }

 private:
  void BuildSides(TownBuilder& builder, std::size_t street, std::uint64_t seed) {
    for (const double side : {1.0, -1.0}) {
      const std::uint64_t side_seed = Mix(Mix(seed, 3), 2 * street + (side > 0.0 ? 0 : 1));
      builder.BuildSide({&town_.streets[street], side}, network_.classes[street],
                        Random(side_seed));
    }
  }

  template <typename Thing>
  void TearDown(std::vector<Thing>& things, std::size_t kind,
                const std::vector<bool>& is_rebuilt) const {
    std::vector<Thing> kept;
    for (std::size_t i = 0; i < is_rebuilt.size(); ++i) {
      if (is_rebuilt[i]) continue;
      const auto begin = things.begin();
      kept.insert(kept.end(), begin + static_cast<std::ptrdiff_t>(begins_[i][kind]),
                  begin + static_cast<std::ptrdiff_t>(begins_[i + 1][kind]));
    }
    things = std::move(kept);
  }

  Town& town_;
  const Network& network_;
  const std::uint64_t seed_;
  std::vector<std::array<std::size_t, 3>> begins_;  // of each street's things, and the end
};

}  // namespace

absl::Status Validate(const TownOptions& options) {
  RETURN_IF_ERROR(CheckRange("rebuilt_share", options.rebuilt_share, 0, 1));
  return CheckRange("length_m", options.length_m, 20, 100'000);
}

absl::StatusOr<Town> MakeTown(const TownOptions& options) {
  RETURN_IF_ERROR(Validate(options));
  const std::uint64_t seed = Mix(options.town_seed, 0x70);
  const Network network = MakeNetwork(options.length_m, Random(Mix(seed, 1)));
  Town town;
  town.options = options;
  town.ground = MakeGround(network.streets, Random(Mix(seed, 2)));
  // A roadside points to its street: those of the town, which stay.
  town.streets = network.streets;
  town.route = network.route;
  Frontages frontages(town, network, seed);
  frontages.BuildAll();
  if (options.rebuilt_share > 0.0) frontages.Rebuild(ChooseRebuilt(town));
  return town;
}

}  // namespace scanloc::sim
