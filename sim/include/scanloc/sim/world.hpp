#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace scanloc::sim {

/// What a drive goes through. Towns are streets; the others are walked or driven inside.
enum class WorldKind : std::uint8_t {
  kTown,
  kCampus,      ///< large buildings on lawns, trees, lamps, paths
  kForest,      ///< a winding path over hills between trees
  kTunnel,      ///< a road tunnel with niches at equal distances
  kWarehouse,   ///< alike aisles of high racks
  kOffice,      ///< alike storeys: a corridor, rooms, stairs or a lift
  kGarage,      ///< alike decks: columns, parked cars, ramps
  kHome,        ///< one flat with its furniture
  kRoom,        ///< one room with its furniture
  kHall,        ///< a hall that is symmetrical about its centre, with loose things in it
  kCornerRoom,  ///< a room around a corner, like the letter L
};

/// As in `--world`: town, campus, ...
[[nodiscard]] const char* WorldKindName(WorldKind kind);
/// InvalidArgument that lists them: no such world.
[[nodiscard]] absl::StatusOr<WorldKind> ParseWorldKind(std::string_view name);
[[nodiscard]] std::vector<std::string> WorldKindNames();

/// Whether the length of its route is part of what such a world is.
[[nodiscard]] constexpr bool IsMadeForLength(WorldKind kind) {
  return kind == WorldKind::kTown || kind == WorldKind::kCampus || kind == WorldKind::kForest ||
         kind == WorldKind::kTunnel;
}
/// Longer than the route of any other world.
inline constexpr double kWholeRoute_m = 100'000.0;

/// What a world that is no town is made of, beside the seed and the length of a TownOptions. The
/// length of a campus, forest or tunnel is part of what it is; in the others the route ends there
/// at the latest.
struct WorldOptions {
  WorldKind kind = WorldKind::kTown;
  int num_floors = 3;   ///< storeys of an office, decks of a garage; in [1, 30]
  int num_aisles = 20;  ///< of a warehouse; in [1, 60]
  /// Share of the furniture, the stock and the undergrowth that differs between any two sessions,
  /// in [0, 1]. Cars and people always do.
  double changed_share = 0.5;
};

/// OK, or InvalidArgument that names the first bad field.
[[nodiscard]] absl::Status Validate(const WorldOptions& options);

}  // namespace scanloc::sim
