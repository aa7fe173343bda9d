#include "scanloc/sim/world.hpp"

#include <array>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "scanloc/core/status_macros.hpp"
#include "sim_text.hpp"
#include "worlds/scene.hpp"

namespace scanloc::sim {
namespace {

struct Kind {
  WorldKind kind;
  const char* name;
  Scene (*make)(const SceneOptions&);
};

constexpr std::array<Kind, 11> kKinds = {{
    {WorldKind::kTown, "town", nullptr},
    {WorldKind::kCampus, "campus", &MakeCampus},
    {WorldKind::kForest, "forest", &MakeForest},
    {WorldKind::kTunnel, "tunnel", &MakeTunnel},
    {WorldKind::kWarehouse, "warehouse", &MakeWarehouse},
    {WorldKind::kOffice, "office", &MakeOffice},
    {WorldKind::kGarage, "garage", &MakeGarage},
    {WorldKind::kHome, "home", &MakeHome},
    {WorldKind::kRoom, "room", &MakeRoom},
    {WorldKind::kHall, "hall", &MakeHall},
    {WorldKind::kCornerRoom, "corner-room", &MakeCornerRoom},
}};

}  // namespace

const char* WorldKindName(WorldKind kind) { return kKinds[static_cast<std::size_t>(kind)].name; }

absl::StatusOr<WorldKind> ParseWorldKind(std::string_view name) {
  for (const Kind& kind : kKinds) {
    if (name == kind.name) return kind.kind;
  }
  return absl::InvalidArgumentError(absl::StrCat("no world is called '", std::string(name),
                                                 "'; it must be one of ",
                                                 absl::StrJoin(WorldKindNames(), ", ")));
}

std::vector<std::string> WorldKindNames() {
  std::vector<std::string> names;
  for (const Kind& kind : kKinds) names.emplace_back(kind.name);
  return names;
}

absl::Status Validate(const WorldOptions& options) {
  RETURN_IF_ERROR(CheckRange("num_floors", options.num_floors, 1, 30));
  RETURN_IF_ERROR(CheckRange("num_aisles", options.num_aisles, 1, 60));
  return CheckRange("changed_share", options.changed_share, 0, 1);
}

Scene MakeScene(const SceneOptions& options) {
  return kKinds[static_cast<std::size_t>(options.world.kind)].make(options);
}

}  // namespace scanloc::sim
