#include "scanloc/mapdb/edit_map.hpp"

#include <algorithm>
#include <set>

#include "absl/strings/str_cat.h"
#include "copy_places.hpp"

namespace scanloc::mapdb {

absl::StatusOr<EditSummary> EditMap(const std::string& in, const std::string& out,
                                    const std::vector<Edit>& edits, HistoryEntry made_by,
                                    const Finish& finish) {
  if (absl::Status status = CheckIsNew(out); !status.ok()) return status;
  absl::StatusOr<CopySource> source = ReadSource(in);
  if (!source.ok()) return source.status();
  const bool is_moved = std::ranges::any_of(
      edits, [](const Edit& edit) { return std::holds_alternative<Transform>(edit); });
  if (is_moved) source->info.geo_origin.reset();
  absl::StatusOr<std::vector<CopiedPlace>> all = AllPlaces(*source);
  if (!all.ok()) return all.status();
  std::vector<EditedPlace> places;
  for (const CopiedPlace& copied : *all) {
    places.push_back({static_cast<std::size_t>(copied.place), copied.session, copied.scan.stamp_ns,
                      copied.scan.T_map_place});
  }
  EditSummary summary{.num_places_before = places.size()};
  absl::StatusOr<EditPlan> plan = PlanEdits(std::move(places), edits);
  if (!plan.ok()) return plan.status();
  summary.plan = *std::move(plan);
  std::vector<CopiedPlace> kept;
  for (const EditedPlace& edited : summary.plan.places) {
    kept.push_back(std::move((*all)[edited.place]));
    kept.back().session = edited.session;
    kept.back().scan.T_map_place = edited.T_map_place;
  }
  absl::StatusOr<std::string> content_id =
      WriteCopy(out, {PartOf(*source, std::move(kept))}, std::move(made_by), finish);
  if (!content_id.ok()) return content_id.status();
  summary.content_id = *std::move(content_id);
  return summary;
}

absl::StatusOr<std::string> ReplacePlaces(const std::string& old_map,
                                          const std::vector<bool>& replaced,
                                          const std::string& new_map, const std::string& out,
                                          HistoryEntry made_by, const Finish& finish) {
  if (absl::Status status = CheckIsNew(out); !status.ok()) return status;
  const absl::StatusOr<CopySource> before = ReadSource(old_map);
  if (!before.ok()) return before.status();
  const absl::StatusOr<CopySource> after = ReadSource(new_map);
  if (!after.ok()) return after.status();
  absl::StatusOr<std::vector<CopiedPlace>> old_places = AllPlaces(*before);
  if (!old_places.ok()) return old_places.status();
  absl::StatusOr<std::vector<CopiedPlace>> added = AllPlaces(*after);
  if (!added.ok()) return added.status();
  if (replaced.size() != old_places->size()) {
    return absl::InvalidArgumentError(absl::StrCat("map '", old_map, "' has ", old_places->size(),
                                                   " places, not ", replaced.size()));
  }
  std::vector<CopiedPlace> stays;
  std::set<std::string> taken;
  for (CopiedPlace& copied : *old_places) {
    if (replaced[static_cast<std::size_t>(copied.place)]) continue;
    taken.insert(copied.session);
    stays.push_back(std::move(copied));
  }
  for (CopiedPlace& copied : *added) copied.session = FreeName(copied.session, taken);
  return WriteCopy(out, {PartOf(*before, std::move(stays)), PartOf(*after, *std::move(added))},
                   std::move(made_by), finish);
}

}  // namespace scanloc::mapdb
