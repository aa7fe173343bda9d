#include "map/narrowing.hpp"

#include <algorithm>

#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "scanloc/core/printable.hpp"

namespace scanloc {
namespace {

/// One a session of the map: whether the prior takes it.
absl::StatusOr<std::vector<bool>> SessionsOf(const Map& map, const Prior& prior) {
  std::vector<bool> is_taken(map.sessions.size(), prior.sessions.empty());
  for (const std::string& name : prior.sessions) {
    const auto found = std::find(map.sessions.begin(), map.sessions.end(), name);
    if (found == map.sessions.end()) {
      constexpr std::size_t kMostTold = 10;
      const std::size_t num_told = std::min(kMostTold, map.sessions.size());
      return absl::InvalidArgumentError(absl::StrFormat(
          "the prior names the session \"%s\", which the map does not have; it has %s%s",
          Printable(name),
          absl::StrJoin(map.sessions.begin(), map.sessions.begin() + num_told, ", "),
          num_told < map.sessions.size() ? " and others" : ""));
    }
    is_taken[static_cast<std::size_t>(found - map.sessions.begin())] = true;
  }
  return is_taken;
}

bool Holds(const Prior& prior, const Eigen::Vector3d& position_m) {
  if (prior.disc) {
    const Eigen::Vector2d off_m =
        position_m.head<2>() - Eigen::Vector2d(prior.disc->x_m, prior.disc->y_m);
    if (off_m.norm() > prior.disc->radius_m) return false;
  }
  return !prior.heights ||
         (position_m.z() >= prior.heights->min_m && position_m.z() <= prior.heights->max_m);
}

}  // namespace

absl::StatusOr<Narrowing> Narrow(const Map& map, const Prior& prior,
                                 const std::vector<bool>* excluded) {
  if (prior.on_earth) {
    return absl::InvalidArgumentError(
        "the prior is a place on earth; geo::InMapFrame makes one of the map of it");
  }
  const absl::StatusOr<std::vector<bool>> sessions = SessionsOf(map, prior);
  if (!sessions.ok()) return sessions.status();
  Narrowing narrowing;
  narrowing.excluded.resize(map.places.size());
  for (std::size_t i = 0; i < map.places.size(); ++i) {
    const Place& place = map.places[i];
    const bool is_left = (excluded == nullptr || !(*excluded)[i]) &&
                         (*sessions)[static_cast<std::size_t>(place.session)] &&
                         Holds(prior, place.T_map_place.translation());
    narrowing.excluded[i] = !is_left;
    narrowing.num_places += is_left ? 1 : 0;
  }
  return narrowing;
}

}  // namespace scanloc
