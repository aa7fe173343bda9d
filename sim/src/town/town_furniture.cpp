#include <algorithm>

#include "town/town_builder.hpp"

namespace scanloc::sim {
namespace {

constexpr double kBuried_m = 0.5;
constexpr double kCarSlot_m = 5.8;

Solid Upright(SolidShape shape, const Eigen::Vector2d& at, double radius_m, double low_m,
              double high_m) {
  Solid solid;
  solid.shape = shape;
  solid.center = at;
  solid.half_length_m = radius_m;
  solid.half_width_m = radius_m;
  solid.z_min_m = low_m;
  solid.z_max_m = high_m;
  return solid;
}

Solid Panel(const Eigen::Vector2d& at, const Eigen::Vector2d& axis, double length_m, double width_m,
            double low_m, double high_m) {
  Solid solid = Upright(SolidShape::kBox, at, 0.5 * length_m, low_m, high_m);
  solid.axis = axis;
  solid.half_width_m = 0.5 * width_m;
  return solid;
}

}  // namespace

void TownBuilder::Pole(const Eigen::Vector2d& at, double radius_m, double height_m) {
  Put(town_.fixed, Upright(SolidShape::kCylinder, at, radius_m, -kBuried_m, height_m), 0.0);
}

void TownBuilder::Plant(const Roadside& roadside, double along_m, double offset_m, double size,
                        Random& random) {
  const Eigen::Vector2d at = roadside.At(along_m, offset_m);
  const double crown_bottom = random.Uniform(2.3, 3.0) * std::max(0.8, size);
  const double crown_top = crown_bottom + size * random.Uniform(3.0, 5.0);
  const double crown_radius = size * random.Uniform(1.4, 2.4);
  Solid trunk = Upright(SolidShape::kCylinder, at, size * random.Uniform(0.12, 0.22), -kBuried_m,
                        crown_bottom + 0.8);
  if (!Put(town_.fixed, trunk, 0.2)) return;
  // Crowns hang over streets and against walls: only the trunk needs ground of its own.
  const double level = town_.fixed.back().z_max_m - trunk.z_max_m;
  Solid crown =
      Upright(SolidShape::kEllipsoid, at, crown_radius, crown_bottom + level, crown_top + level);
  crown.penetration_m = random.Uniform(1.5, 4.0);
  town_.fixed.push_back(crown);
}

void TownBuilder::PlantRow(const Roadside& roadside, double offset_m, Random& random) {
  const double spacing = random.Uniform(7.0, 13.0);
  const double size = random.Uniform(0.7, 1.5);
  for (double along = roadside.begin_m() + random.Uniform(0.0, spacing); along < roadside.end_m();
       along += spacing) {
    if (random.Chance(0.15)) continue;
    const double jitter = random.Uniform(-0.6, 0.6);
    Plant(roadside, along + jitter, offset_m, size * random.Uniform(0.85, 1.15), random);
  }
}

void TownBuilder::PlantPark(const Roadside& roadside, double pavement_m, Random& random) {
  const double length = roadside.end_m() - roadside.begin_m();
  const double depth = random.Uniform(20.0, 45.0);
  const int count = static_cast<int>(length * depth / random.Uniform(60.0, 200.0));
  for (int i = 0; i < count; ++i) {
    const double along = random.Uniform(roadside.begin_m(), roadside.end_m());
    const double offset = roadside.street->kerb_half_m + pavement_m + random.Uniform(1.0, depth);
    Plant(roadside, along, offset, random.Uniform(0.6, 2.0), random);
  }
}

void TownBuilder::Fence(const Roadside& roadside, Frontage frontage, double offset_m,
                        Random& random) {
  const bool gardens = frontage == Frontage::kHouses || frontage == Frontage::kPark ||
                       frontage == Frontage::kOpen || frontage == Frontage::kIndustry;
  if (!random.Chance(gardens ? 0.75 : 0.2)) return;
  const bool hedge = random.Chance(0.45);
  const double height = random.Chance(0.3) ? random.Uniform(1.6, 2.3) : random.Uniform(0.7, 1.3);
  const double width = hedge ? random.Uniform(0.6, 1.1) : random.Uniform(0.08, 0.3);
  double along = roadside.begin_m();
  while (along < roadside.end_m()) {
    const double length = std::min(random.Uniform(4.0, 12.0), roadside.end_m() - along);
    if (length < 1.0) break;
    const double middle = along + 0.5 * length;
    const Solid segment =
        Panel(roadside.At(middle, offset_m + 0.5 * width), roadside.street->center.Tangent(middle),
              length, width, -kBuried_m, height + random.Uniform(-0.1, 0.1));
    const bool changeable = hedge && random.Chance(0.4);
    if (random.Chance(0.9)) Put(changeable ? town_.changeable : town_.fixed, segment, 0.0);
    along += length + (random.Chance(0.5) ? random.Uniform(2.5, 4.5) : 0.0);
  }
}

void TownBuilder::Furnish(const Roadside& roadside, Random& random) {
  const double kerb = roadside.street->kerb_half_m + 0.7;
  const double lamps = random.Uniform(24.0, 36.0);
  const double lamp_height = random.Uniform(4.5, 9.0);
  for (double along = roadside.begin_m() + random.Uniform(0.0, lamps); along < roadside.end_m();
       along += lamps) {
    Pole(roadside.At(along, kerb), 0.09, lamp_height);
  }
  const int count = static_cast<int>((roadside.end_m() - roadside.begin_m()) / 12.0);
  for (int i = 0; i < count; ++i) {
    const double along = random.Uniform(roadside.begin_m(), roadside.end_m());
    const Eigen::Vector2d tangent = roadside.street->center.Tangent(along);
    const Eigen::Vector2d at = roadside.At(along, kerb + random.Uniform(0.0, 0.4));
    const double kind = random.Uniform(0.0, 1.0);
    if (kind < 0.45) {  // a street sign, facing the traffic
      Pole(at, 0.04, 2.9);
      Put(town_.fixed, Panel(at, LeftOf(tangent), 0.65, 0.05, 2.1, 2.8), 0.0);
    } else if (kind < 0.65) {  // a cabinet
      const double length = random.Uniform(0.6, 1.6);
      Put(town_.fixed, Panel(at, tangent, length, 0.4, -kBuried_m, random.Uniform(0.9, 1.5)), 0.1);
    } else if (kind < 0.75) {  // an advertising column, a kiosk
      Pole(at + LeftOf(tangent) * (0.6 * roadside.side), 0.6, random.Uniform(2.6, 3.6));
    } else if (kind < 0.83) {  // a bus shelter
      const Eigen::Vector2d middle = at + LeftOf(tangent) * (1.0 * roadside.side);
      Put(town_.fixed, Panel(middle, tangent, 4.0, 0.15, -kBuried_m, 2.5), 0.1);
      Put(town_.fixed, Panel(middle, tangent, 4.2, 1.5, 2.4, 2.6), 0.1);
    } else {  // a builder's container or skip
      const double length = random.Chance(0.4) ? 6.0 : 3.4;
      Put(town_.changeable,
          Panel(at + LeftOf(tangent) * (1.2 * roadside.side), tangent, length, 2.3, -kBuried_m,
                length > 4.0 ? 2.6 : 1.5),
          0.2);
    }
  }
}

void TownBuilder::MarkParking(const Roadside& roadside, Frontage frontage, double pavement_m,
                              Random& random) {
  const Street& street = *roadside.street;
  if (street.kerb_half_m - street.lanes_half_m > 2.2 && random.Chance(0.85)) {
    for (double along = roadside.begin_m() + 3.0; along + 3.0 < roadside.end_m();
         along += kCarSlot_m) {
      if (random.Chance(0.1)) continue;  // a gate, a crossing for pedestrians
      town_.parking.push_back(
          {roadside.At(along, street.kerb_half_m - 1.1), street.center.Tangent(along)});
    }
  }
  if (frontage != Frontage::kOpen || !random.Chance(0.7)) return;
  // A car park: rows of cars across the street's direction.
  const double fence = street.kerb_half_m + pavement_m;
  for (int row = 0; row < 3; ++row) {
    for (double along = roadside.begin_m() + 4.0; along + 4.0 < roadside.end_m(); along += 2.7) {
      const Eigen::Vector2d at = roadside.At(along, fence + 5.0 + 11.0 * row);
      const Solid slot = Panel(at, LeftOf(street.center.Tangent(along)), 5.0, 2.2, 0.0, 1.0);
      if (!site_.Fits(slot, 0.2)) continue;
      site_.Take(slot);
      town_.parking.push_back({slot.center, slot.axis});
    }
  }
}

}  // namespace scanloc::sim
