#pragma once

#include <vector>

#include "random.hpp"
#include "scanloc/sim/town.hpp"
#include "town/town_network.hpp"
#include "town/town_site.hpp"

namespace scanloc::sim {

/// What stands along one side of one street.
enum class Frontage { kHouses, kTerrace, kBlocks, kTowers, kIndustry, kPark, kOpen };

/// A spot along one side of a street; offsets are from the centre line, away from it.
struct Roadside {
  const Street* street = nullptr;
  double side = 1.0;  ///< +1 left, -1 right

  [[nodiscard]] double begin_m() const { return street->begin_margin_m; }
  [[nodiscard]] double end_m() const { return street->center.length_m() - street->end_margin_m; }
  [[nodiscard]] Eigen::Vector2d At(double along_m, double offset_m) const {
    return street->center.At(along_m) + LeftOf(street->center.Tangent(along_m)) * (side * offset_m);
  }
};

/// Puts solids of a town where there is room for them.
class TownBuilder {
 public:
  TownBuilder(Town& town, const Network& network);

  /// Builds one side of a street. `random` decides everything, so that sides are independent.
  void BuildSide(const Roadside& roadside, StreetClass street_class, Random random);
  /// Leaves the ground that the solid stands on to it.
  void KeepClearOf(const Solid& solid) { site_.Take(solid); }

 private:
  /// Measures of a building that may be repeated along a street.
  struct BuildingType {
    double width_m;
    double depth_m;
    double height_m;
    double roof_m;     // of a second, narrower storey; 0 for none
    double setback_m;  // from the pavement
    double gap_m;      // to the next one
    double porch_m;    // depth of what stands out towards the street; 0 for none
  };

  static BuildingType MakeType(Frontage frontage, Random& random);
  BuildingType ChooseType(Frontage frontage, Random& random) const;

  void BuildRow(const Roadside& roadside, Frontage frontage, double pavement_m, Random& random);
  bool PlaceBuilding(const Roadside& roadside, double along_m, double front_m,
                     const BuildingType& type, Random& random);
  void BuildBehind(const Roadside& roadside, double along_m, double back_m, Frontage frontage,
                   Random& random);

  void Fence(const Roadside& roadside, Frontage frontage, double offset_m, Random& random);
  void Plant(const Roadside& roadside, double along_m, double offset_m, double size,
             Random& random);
  void PlantRow(const Roadside& roadside, double offset_m, Random& random);
  void PlantPark(const Roadside& roadside, double pavement_m, Random& random);
  void Furnish(const Roadside& roadside, Random& random);
  void Pole(const Eigen::Vector2d& at, double radius_m, double height_m);
  void MarkParking(const Roadside& roadside, Frontage frontage, double pavement_m, Random& random);

  /// Adds the solid to `to` if it is clear of streets and buildings; heights are above the kerb.
  bool Put(std::vector<Solid>& to, Solid solid, double gap_m);

  Town& town_;
  Site site_;
  std::vector<BuildingType> house_types_;
  std::vector<BuildingType> terrace_types_;
};

}  // namespace scanloc::sim
