#include "scanloc/mapdb/edit_map.hpp"

#include <algorithm>
#include <set>
#include <variant>

#include "absl/strings/str_cat.h"
#include "copy_places.hpp"

namespace scanloc::mapdb {

absl::StatusOr<EditSummary> EditMap(const std::string& in, const std::string& out,
                                    const std::vector<Edit>& edits, HistoryEntry made_by,
                                    const Finish& finish) {
  if (absl::Status status = CheckIsNew(out); !status.ok()) return status;
  absl::StatusOr<CopySource> source = ReadSource(in);
  if (!source.ok()) return source.status();
  const bool is_moved = std::any_of(edits.begin(), edits.end(), [](const Edit& edit) {
    return std::holds_alternative<Transform>(edit);
  });
  if (is_moved) source->info.geo_origin.reset();
  std::vector<EditedPlace> places;
  for (const CopiedPlace& copied : AllPlaces(*source)) {
    const auto place = static_cast<std::size_t>(copied.place);
    places.push_back(
        {place, copied.session, source->places[place].place.stamp_ns, copied.T_map_place});
  }
  EditSummary summary{.num_places_before = places.size()};
  absl::StatusOr<EditPlan> plan = PlanEdits(std::move(places), edits);
  if (!plan.ok()) return plan.status();
  summary.plan = *std::move(plan);
  CopyPart part{.source = &*source, .places = {}};
  for (const EditedPlace& edited : summary.plan.places) {
    part.places.push_back(
        {static_cast<std::int64_t>(edited.place), edited.session, edited.T_map_place});
  }
  absl::StatusOr<std::string> content_id = WriteCopy(out, {part}, std::move(made_by), finish);
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
  if (replaced.size() != before->places.size()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "map '", old_map, "' has ", before->places.size(), " places, not ", replaced.size()));
  }
  CopyPart stays{.source = &*before, .places = {}};
  std::set<std::string> taken;
  for (CopiedPlace& copied : AllPlaces(*before)) {
    if (replaced[static_cast<std::size_t>(copied.place)]) continue;
    taken.insert(copied.session);
    stays.places.push_back(std::move(copied));
  }
  CopyPart added{.source = &*after, .places = AllPlaces(*after)};
  for (CopiedPlace& copied : added.places) copied.session = FreeName(copied.session, taken);
  return WriteCopy(out, {std::move(stays), std::move(added)}, std::move(made_by), finish);
}

}  // namespace scanloc::mapdb
