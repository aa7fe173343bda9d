#include <algorithm>

#include "town/town_builder.hpp"

namespace scanloc::sim {
namespace {

/// From the route's centre line to the nearest thing that does not move: every lane shift that a
/// session may ask for stays clear of it.
constexpr double kRouteClearance_m = 6.6;
constexpr double kStorey_m = 3.0;

Frontage ChooseFrontage(StreetClass street_class, Random& random) {
  struct Share {
    Frontage frontage;
    double share;
  };
  static constexpr Share kResidential[] = {{Frontage::kHouses, 0.46}, {Frontage::kTerrace, 0.30},
                                           {Frontage::kBlocks, 0.07}, {Frontage::kPark, 0.07},
                                           {Frontage::kOpen, 0.06},   {Frontage::kIndustry, 0.04}};
  static constexpr Share kCollector[] = {{Frontage::kTerrace, 0.34}, {Frontage::kBlocks, 0.28},
                                         {Frontage::kHouses, 0.14},  {Frontage::kTowers, 0.06},
                                         {Frontage::kPark, 0.08},    {Frontage::kIndustry, 0.05},
                                         {Frontage::kOpen, 0.05}};
  static constexpr Share kAvenue[] = {{Frontage::kBlocks, 0.38},   {Frontage::kTowers, 0.18},
                                      {Frontage::kTerrace, 0.12},  {Frontage::kPark, 0.14},
                                      {Frontage::kIndustry, 0.08}, {Frontage::kOpen, 0.10}};
  const auto choose = [&random](const auto& shares) {
    double rest = random.Uniform(0.0, 1.0);
    for (const Share& share : shares) {
      rest -= share.share;
      if (rest < 0.0) return share.frontage;
    }
    return shares[0].frontage;
  };
  switch (street_class) {
    case StreetClass::kResidential:
      return choose(kResidential);
    case StreetClass::kCollector:
      return choose(kCollector);
    case StreetClass::kAvenue:
      return choose(kAvenue);
  }
  return Frontage::kOpen;
}

}  // namespace

TownBuilder::TownBuilder(Town& town, const Network& network) : town_(town) {
  for (const Street& street : network.streets) {
    site_.KeepFree(street.center, street.kerb_half_m + 0.4);
  }
  site_.KeepFree(network.route, kRouteClearance_m);
  // Few types for a whole town: places that look alike must exist.
  Random random(Mix(town.options.town_seed, 0x7E));
  for (int i = 0; i < 4; ++i) house_types_.push_back(MakeType(Frontage::kHouses, random));
  for (int i = 0; i < 4; ++i) terrace_types_.push_back(MakeType(Frontage::kTerrace, random));
}

TownBuilder::BuildingType TownBuilder::MakeType(Frontage frontage, Random& random) {
  const auto storeys = [&random](int low, int high) {
    const int count = low + random.Index(high - low + 1);
    return kStorey_m * count + random.Uniform(0.0, 0.8);
  };
  switch (frontage) {
    case Frontage::kHouses:
      return {random.Uniform(8.0, 13.0),
              random.Uniform(8.0, 11.0),
              storeys(1, 2),
              random.Uniform(1.5, 3.0),
              random.Uniform(2.5, 7.0),
              random.Uniform(2.0, 6.0),
              random.Chance(0.5) ? random.Uniform(1.0, 1.8) : 0.0};
    case Frontage::kTerrace:
      return {random.Uniform(5.0, 8.0),
              random.Uniform(9.0, 12.0),
              storeys(2, 4),
              random.Chance(0.6) ? random.Uniform(1.5, 2.5) : 0.0,
              random.Chance(0.5) ? 0.0 : random.Uniform(1.0, 4.0),
              0.0,
              random.Chance(0.4) ? random.Uniform(0.8, 1.2) : 0.0};
    case Frontage::kTowers:
      return {random.Uniform(16.0, 28.0), random.Uniform(14.0, 22.0), storeys(7, 12),          3.0,
              random.Uniform(4.0, 14.0),  random.Uniform(12.0, 30.0), random.Uniform(0.0, 6.0)};
    case Frontage::kIndustry:
      return {random.Uniform(22.0, 45.0),
              random.Uniform(18.0, 30.0),
              random.Uniform(4.5, 9.0),
              0.0,
              random.Uniform(6.0, 16.0),
              random.Uniform(8.0, 20.0),
              0.0};
    default:
      return {random.Uniform(14.0, 34.0),
              random.Uniform(10.0, 16.0),
              storeys(3, 8),
              random.Chance(0.4) ? 3.0 : 0.0,
              random.Uniform(0.0, 6.0),
              random.Uniform(0.0, 14.0),
              random.Chance(0.3) ? random.Uniform(1.0, 3.0) : 0.0};
  }
}

TownBuilder::BuildingType TownBuilder::ChooseType(Frontage frontage, Random& random) const {
  if (frontage == Frontage::kHouses && random.Chance(0.75)) return house_types_[random.Index(4)];
  if (frontage == Frontage::kTerrace && random.Chance(0.75)) return terrace_types_[random.Index(4)];
  return MakeType(frontage, random);
}

bool TownBuilder::Put(std::vector<Solid>& to, Solid solid, double gap_m) {
  if (!site_.Fits(solid, gap_m)) return false;
  const double level = town_.ground.Height(solid.center.x(), solid.center.y()) + Ground::kKerb_m;
  solid.z_min_m += level;
  solid.z_max_m += level;
  to.push_back(solid);
  return true;
}

bool TownBuilder::PlaceBuilding(const Roadside& roadside, double along_m, double front_m,
                                const BuildingType& type, Random& random) {
  constexpr double kBuried_m = 3.0;  // so that no gap opens on a slope
  const Eigen::Vector2d tangent = roadside.street->center.Tangent(along_m);
  const Eigen::Vector2d turn = CosSin(Radians(random.Uniform(-1.5, 1.5)));
  Solid body;
  body.axis = {tangent.x() * turn.x() - tangent.y() * turn.y(),
               tangent.x() * turn.y() + tangent.y() * turn.x()};
  body.center = roadside.At(along_m, front_m + 0.5 * type.depth_m);
  body.half_length_m = 0.5 * type.width_m;
  body.half_width_m = 0.5 * type.depth_m;
  body.z_min_m = -kBuried_m;
  body.z_max_m = type.height_m;
  if (!Put(town_.fixed, body, -0.3)) return false;
  site_.Take(body);

  const double level = town_.fixed.back().z_max_m - body.z_max_m;
  const Eigen::Vector2d away = LeftOf(body.axis) * roadside.side;
  const auto add = [&](double along, double across, double length, double width, double low,
                       double high) {
    Solid part = body;
    part.center += body.axis * along + away * across;
    part.half_length_m = 0.5 * length;
    part.half_width_m = 0.5 * width;
    part.z_min_m = low + level;
    part.z_max_m = high + level;
    town_.fixed.push_back(part);
  };
  if (type.roof_m > 0.0) {
    add(0.0, 0.0, 0.92 * type.width_m, 0.5 * type.depth_m, type.height_m - 0.1,
        type.height_m + type.roof_m);
  }
  if (type.porch_m > 0.0) {
    const double width = random.Uniform(0.25, 0.5) * type.width_m;
    const double along = random.Uniform(-0.5, 0.5) * (type.width_m - width);
    add(along, -0.5 * (type.depth_m + type.porch_m), width, type.porch_m, -kBuried_m,
        std::min(type.height_m, random.Uniform(2.6, 3.6)));
  }
  return true;
}

void TownBuilder::BuildBehind(const Roadside& roadside, double along_m, double back_m,
                              Frontage frontage, Random& random) {
  if (!random.Chance(0.55)) return;
  BuildingType type =
      MakeType(frontage == Frontage::kHouses ? Frontage::kHouses : Frontage::kBlocks, random);
  if (random.Chance(0.4)) type.height_m = random.Uniform(2.4, 5.0);  // a shed, a garage, a workshop
  along_m += random.Uniform(-4.0, 4.0);
  PlaceBuilding(roadside, along_m, back_m + random.Uniform(5.0, 22.0), type, random);
}

void TownBuilder::BuildRow(const Roadside& roadside, Frontage frontage, double pavement_m,
                           Random& random) {
  const double front = roadside.street->kerb_half_m + pavement_m;
  double along = roadside.begin_m() + random.Uniform(0.0, 5.0);
  int repeats = 0;
  BuildingType type{};
  while (along < roadside.end_m()) {
    if (repeats-- == 0) {
      type = ChooseType(frontage, random);
      const bool row = frontage == Frontage::kHouses || frontage == Frontage::kTerrace;
      repeats = row ? 4 + random.Index(9) : random.Index(3);
      if (random.Chance(0.25)) along += random.Uniform(3.0, 14.0);  // a passage, a yard, a plot
    }
    BuildingType one = type;
    one.setback_m += random.Uniform(0.0, 0.5);
    if (random.Chance(0.12)) one.height_m += kStorey_m;
    const double middle = along + 0.5 * one.width_m;
    if (middle + 0.5 * one.width_m > roadside.end_m()) break;
    PlaceBuilding(roadside, middle, front + one.setback_m + one.porch_m, one, random);
    BuildBehind(roadside, middle, front + one.setback_m + one.porch_m + one.depth_m, frontage,
                random);
    along += one.width_m + one.gap_m * random.Uniform(0.8, 1.2);
  }
}

void TownBuilder::BuildSide(const Roadside& roadside, StreetClass street_class, Random random) {
  if (roadside.end_m() - roadside.begin_m() < 8.0) return;
  const Frontage frontage = ChooseFrontage(street_class, random);
  const double pavement_m =
      street_class == StreetClass::kAvenue ? random.Uniform(3.0, 6.0) : random.Uniform(1.6, 3.4);
  if (frontage == Frontage::kPark) {
    PlantPark(roadside, pavement_m, random);
  } else if (frontage != Frontage::kOpen) {
    BuildRow(roadside, frontage, pavement_m, random);
  }
  Fence(roadside, frontage, roadside.street->kerb_half_m + pavement_m, random);
  const double trees = street_class == StreetClass::kAvenue ? 0.65 : 0.35;
  if (random.Chance(trees)) PlantRow(roadside, roadside.street->kerb_half_m + 0.9, random);
  Furnish(roadside, random);
  MarkParking(roadside, frontage, pavement_m, random);
}

}  // namespace scanloc::sim
