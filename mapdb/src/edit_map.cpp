#include "scanloc/mapdb/edit_map.hpp"

#include <algorithm>
#include <set>

#include "absl/strings/str_cat.h"
#include "copy_places.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::mapdb {

absl::StatusOr<EditSummary> EditMap(const std::string& in, const std::string& out,
                                    const std::vector<Edit>& edits, HistoryEntry made_by,
                                    const Finish& finish) {
  RETURN_IF_ERROR(CheckIsNew(out));
  ASSIGN_OR_RETURN(CopySource source, ReadSource(in));
  const bool is_moved = std::ranges::any_of(
      edits, [](const Edit& edit) { return std::holds_alternative<Transform>(edit); });
  if (is_moved) source.info.geo_origin.reset();
  ASSIGN_OR_RETURN(std::vector<CopiedPlace> all, AllPlaces(source));
  std::vector<EditedPlace> places;
  for (const CopiedPlace& copied : all) {
    places.push_back({static_cast<std::size_t>(copied.place), copied.session, copied.scan.stamp_ns,
                      copied.scan.T_map_place});
  }
  EditSummary summary{.num_places_before = places.size()};
  ASSIGN_OR_RETURN(summary.plan, PlanEdits(std::move(places), edits));
  std::vector<CopiedPlace> kept;
  for (const EditedPlace& edited : summary.plan.places) {
    kept.push_back(std::move(all[edited.place]));
    kept.back().session = edited.session;
    kept.back().scan.T_map_place = edited.T_map_place;
  }
  ASSIGN_OR_RETURN(summary.content_id,
                   WriteCopy(out, {PartOf(source, std::move(kept))}, std::move(made_by), finish));
  return summary;
}

absl::StatusOr<std::string> ReplacePlaces(const std::string& old_map,
                                          const std::vector<bool>& replaced,
                                          const std::string& new_map, const std::string& out,
                                          HistoryEntry made_by, const Finish& finish) {
  RETURN_IF_ERROR(CheckIsNew(out));
  ASSIGN_OR_RETURN(const CopySource before, ReadSource(old_map));
  ASSIGN_OR_RETURN(const CopySource after, ReadSource(new_map));
  ASSIGN_OR_RETURN(std::vector<CopiedPlace> old_places, AllPlaces(before));
  ASSIGN_OR_RETURN(std::vector<CopiedPlace> added, AllPlaces(after));
  if (replaced.size() != old_places.size()) {
    return absl::InvalidArgumentError(absl::StrCat("map '", old_map, "' has ", old_places.size(),
                                                   " places, not ", replaced.size()));
  }
  std::vector<CopiedPlace> stays;
  std::set<std::string> taken;
  for (CopiedPlace& copied : old_places) {
    if (replaced[static_cast<std::size_t>(copied.place)]) continue;
    taken.insert(copied.session);
    stays.push_back(std::move(copied));
  }
  for (CopiedPlace& copied : added) copied.session = FreeName(copied.session, taken);
  return WriteCopy(out, {PartOf(before, std::move(stays)), PartOf(after, std::move(added))},
                   std::move(made_by), finish);
}

}  // namespace scanloc::mapdb
