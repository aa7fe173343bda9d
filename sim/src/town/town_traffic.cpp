#include "town/town_traffic.hpp"

#include <algorithm>
#include <cmath>

#include "random.hpp"
#include "town/town_site.hpp"

namespace scanloc::sim {
namespace {

constexpr double kRightLane_m = 1.75;
constexpr double kLane_m = 3.4;
constexpr double kOwnHalfLength_m = 2.4;
constexpr double kOwnHalfWidth_m = 1.2;

enum class VehicleKind { kCar, kSuv, kVan, kTruck, kBus };

VehicleKind ChooseKind(bool parked, Random& random) {
  const double kind = random.Uniform(0.0, 1.0);
  if (kind < (parked ? 0.62 : 0.50)) return VehicleKind::kCar;
  if (kind < (parked ? 0.84 : 0.70)) return VehicleKind::kSuv;
  if (kind < (parked ? 0.97 : 0.84)) return VehicleKind::kVan;
  if (parked || kind < 0.92) return VehicleKind::kTruck;
  return VehicleKind::kBus;
}

/// One of the two boxes of a vehicle; positions are along its axis from its middle.
struct Part {
  double middle_m;
  double length_m;
  double width_m;
  double low_m;
  double high_m;
};

void AppendVehicle(VehicleKind kind, const Eigen::Vector2d& center, const Eigen::Vector2d& axis,
                   double ground_m, Random& random, std::vector<Solid>& to) {
  const double scale = random.Uniform(0.93, 1.07);
  const auto parts = [kind, &random]() -> std::pair<Part, Part> {
    switch (kind) {
      case VehicleKind::kCar:
        return {{0.0, 4.3, 1.75, 0.2, 0.85}, {-0.3, 2.4, 1.5, 0.85, 1.45}};
      case VehicleKind::kSuv:
        return {{0.0, 4.6, 1.85, 0.25, 1.0}, {-0.5, 3.2, 1.65, 1.0, 1.75}};
      case VehicleKind::kVan:
        return {{0.0, 5.2, 1.95, 0.25, 1.1}, {-0.6, 4.0, 1.9, 1.1, random.Uniform(1.9, 2.6)}};
      case VehicleKind::kTruck:
        return {{3.2, 1.9, 2.3, 0.4, 2.6}, {-1.0, 6.2, 2.45, 0.9, random.Uniform(2.9, 3.7)}};
      case VehicleKind::kBus:
        return {{0.0, 11.8, 2.5, 0.3, 3.0}, {-3.0, 3.0, 2.0, 3.0, 3.25}};
    }
    return {};
  }();
  for (const Part& part : {parts.first, parts.second}) {
    Solid solid;
    solid.axis = axis;
    solid.center = center + axis * (part.middle_m * scale);
    solid.half_length_m = 0.5 * part.length_m * scale;
    solid.half_width_m = 0.5 * part.width_m * scale;
    solid.z_min_m = ground_m + part.low_m;
    solid.z_max_m = ground_m + part.high_m;
    to.push_back(solid);
  }
}

/// Whether the solid reaches into the room that the session's own vehicle needs.
bool IsInTheWay(const Solid& solid, const Eigen::Vector2d& own, const Eigen::Vector2d& own_axis) {
  const Eigen::Vector2d offset = solid.center - own;
  const double half_across = solid.half_length_m * std::abs(solid.axis.dot(LeftOf(own_axis))) +
                             solid.half_width_m * std::abs(solid.axis.dot(own_axis));
  const double half_along = solid.half_length_m * std::abs(solid.axis.dot(own_axis)) +
                            solid.half_width_m * std::abs(solid.axis.dot(LeftOf(own_axis)));
  return std::abs(offset.dot(own_axis)) < half_along + kOwnHalfLength_m &&
         std::abs(offset.dot(LeftOf(own_axis))) < half_across + kOwnHalfWidth_m;
}

}  // namespace

double DrivenOffset(const SessionOptions& options) { return options.lane_shift_m - kRightLane_m; }

std::vector<Solid> MakeStandingTraffic(const Town& town, const SessionOptions& options) {
  Site own_way;
  own_way.KeepFree(town.route, kOwnHalfWidth_m + 0.3, DrivenOffset(options));
  const std::uint64_t seed = Mix(options.session_seed, 0x9A);
  std::vector<Solid> standing;
  const auto add_clear = [&](const std::vector<Solid>& solids) {
    const bool clear =
        std::ranges::all_of(solids, [&](const Solid& s) { return own_way.Fits(s, 0.0); });
    if (clear) standing.insert(standing.end(), solids.begin(), solids.end());
  };
  for (std::size_t i = 0; i < town.parking.size(); ++i) {
    Random random(Mix(seed, i));
    if (!random.Chance(options.parked_share)) continue;
    const ParkingSlot& slot = town.parking[i];
    const double ahead = random.Uniform(-0.5, 0.5);
    const double aside = random.Uniform(-0.15, 0.15);
    const Eigen::Vector2d center = slot.center + slot.axis * ahead + LeftOf(slot.axis) * aside;
    const Eigen::Vector2d axis = random.Chance(0.5) ? slot.axis : Eigen::Vector2d(-slot.axis);
    std::vector<Solid> vehicle;
    AppendVehicle(ChooseKind(true, random), center, axis,
                  town.ground.Height(center.x(), center.y()), random, vehicle);
    add_clear(vehicle);
  }
  constexpr double kPresent = 0.8;
  for (std::size_t i = 0; i < town.changeable.size(); ++i) {
    if (Random(Mix(Mix(seed, 0xC4), i)).Chance(kPresent)) add_clear({town.changeable[i]});
  }
  return standing;
}

MovingTraffic::MovingTraffic(const Town& town, const SessionOptions& options)
    : ground_(town.ground) {
  for (std::size_t i = 0; i < town.streets.size(); ++i) {
    const Street& street = town.streets[i];
    Random random(Mix(Mix(options.session_seed, 0x3B), i));
    const double length = street.center.length_m();
    TrafficOn on{&street, street.center.At(0.5 * length), 0.5 * length + 25.0, {}};
    const double expected = options.moving_per_km * length / 1000.0 * street.num_lanes;
    const int count = static_cast<int>(expected + random.Uniform(0.0, 1.0));
    for (int k = 0; k < count; ++k) {
      const double lane = kRightLane_m + kLane_m * random.Index(street.num_lanes);
      const double direction = random.Chance(0.5) ? 1.0 : -1.0;
      on.vehicles.push_back({random.Uniform(0.0, length), direction * random.Uniform(4.0, 13.0),
                             -direction * lane, random.Next()});
    }
    if (!on.vehicles.empty()) streets_.push_back(std::move(on));
  }
}

void MovingTraffic::AppendAround(const Eigen::Vector2d& own, const Eigen::Vector2d& own_axis,
                                 double radius_m, double time_s, std::vector<Solid>& to) const {
  std::vector<Solid> vehicle;
  for (const TrafficOn& on : streets_) {
    if ((on.middle - own).norm() > radius_m + on.reach_m) continue;
    const Path& center = on.street->center;
    for (const Vehicle& v : on.vehicles) {
      // One that leaves its street at the end comes in again at the beginning.
      const double travelled = v.start_m + v.speed_mps * time_s;
      const double along =
          travelled - std::floor(travelled / center.length_m()) * center.length_m();
      const Eigen::Vector2d tangent = center.Tangent(along);
      const Eigen::Vector2d at = center.At(along) + LeftOf(tangent) * v.offset_m;
      Random random(v.seed);
      const VehicleKind kind = ChooseKind(false, random);
      vehicle.clear();
      AppendVehicle(kind, at, v.speed_mps > 0.0 ? tangent : Eigen::Vector2d(-tangent),
                    ground_.Height(at.x(), at.y()), random, vehicle);
      const bool in_the_way = std::ranges::any_of(
          vehicle, [&](const Solid& s) { return IsInTheWay(s, own, own_axis); });
      if (!in_the_way) to.insert(to.end(), vehicle.begin(), vehicle.end());
    }
  }
}

}  // namespace scanloc::sim
