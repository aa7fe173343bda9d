#include "scanloc/proto/convert_viewer.hpp"

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "fields.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/convert.hpp"

namespace scanloc {
namespace {

/// The place's own context; empty where the map has none.
Context OwnContext(const ContextTable& table, std::int32_t place) {
  std::size_t low = 0;
  std::size_t high = table.size();
  while (low < high) {
    const std::size_t middle = low + (high - low) / 2;
    if (table.entry(middle).place < place) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  for (; low < table.size() && table.entry(low).place == place; ++low) {
    if (table.entry(low).augmented) continue;
    const ContextView view = table.context(low);
    return {.num_rows = view.num_rows,
            .num_cols = view.num_cols,
            .cells_cm = {view.cells_cm.begin(), view.cells_cm.end()}};
  }
  return {};
}

/// The same from the file that a map's contexts and structures are left in.
absl::Status ReadOwn(const Map& map, std::int32_t place, ScanDescriptor* descriptor) {
  using Part = PayloadId::Part;
  std::vector<PayloadId> ids;
  if (map.params.polar.enabled) ids.push_back({place, Part::kPolar, 0});
  if (map.params.cart.enabled) ids.push_back({place, Part::kCart, 0});
  if (map.params.structure.enabled) ids.push_back({place, Part::kStructure, 0});
  std::vector<std::shared_ptr<const Payload>> payloads;
  RETURN_IF_ERROR(map.payload->Read(ids, SearchControl(), payloads));
  for (std::size_t i = 0; i < payloads.size(); ++i) {
    const Payload& payload = *payloads[i];
    if (ids[i].part == Part::kStructure) descriptor->structure = payload.structure;
    if (ids[i].part == Part::kPolar) {
      descriptor->polar = {map.polar.num_rows(), map.polar.num_cols(), payload.cells_cm};
    }
    if (ids[i].part == Part::kCart) {
      descriptor->cart = {map.cart.num_rows(), map.cart.num_cols(), payload.cells_cm};
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PlaceDetails> DetailsOf(const Map& map, std::int32_t place) {
  if (place < 0 || static_cast<std::size_t>(place) >= map.places.size()) {
    return absl::NotFoundError(absl::StrCat("the map has no place ", place, "; it has ",
                                            map.places.size(), ", counted from 0"));
  }
  PlaceDetails details{.content_id = map.content_id, .place = map.places[place], .descriptor = {}};
  if (map.payload != nullptr) {
    RETURN_IF_ERROR(ReadOwn(map, place, &details.descriptor));
    return details;
  }
  details.descriptor.polar = OwnContext(map.polar, place);
  details.descriptor.cart = OwnContext(map.cart, place);
  if (!map.structures.empty()) details.descriptor.structure = map.structures[place];
  return details;
}

absl::StatusOr<PlaceUsePage> PageOfUse(const MapUse& use, std::int32_t first_place,
                                       int max_places) {
  if (first_place < 0 || max_places < 0 || max_places > kMaxPlacesPerPage) {
    return absl::InvalidArgumentError(absl::StrCat(
        "first_place and max_places are ", first_place, " and ", max_places,
        "; the one must not be negative, the other must lie in [0, ", kMaxPlacesPerPage, "]"));
  }
  PlaceUsePage page{.use = TotalsOf(use)};
  const auto most = static_cast<std::size_t>(max_places == 0 ? kMaxPlacesPerPage : max_places);
  for (auto place = use.places.lower_bound(first_place); place != use.places.end(); ++place) {
    if (page.use.places.size() == most) {
      page.next_place = place->first;
      break;
    }
    page.use.places.insert(*place);
  }
  return page;
}

namespace proto {
namespace {

absl::StatusOr<SeenAnswer> SeenFromProto(const v1::SeenAnswer& message) {
  absl::Status status = CheckLength("request_id", message.request_id(), limits::kMaxNameBytes);
  status.Update(CheckLength("client", message.client(), kMaxReasonBytes));
  if (!status.ok()) return status;
  ASSIGN_OR_RETURN(auto reply, proto::FromProto(message.answer()));
  SeenAnswer seen{.number = message.number(),
                  .answered_ns = message.answered_ns(),
                  .request_id = message.request_id(),
                  .client = message.client(),
                  .reply = std::move(reply),
                  .structure = {},
                  .is_of_stream = message.is_of_stream()};
  if (!message.has_structure()) return seen;
  ASSIGN_OR_RETURN(seen.structure, StructureFromProto(message.structure()));
  ASSIGN_OR_RETURN(seen.T_query_structure,
                   PoseFromProto("T_query_structure", message.t_query_structure()));
  return seen;
}

}  // namespace

absl::StatusOr<PlaceDetails> FromProto(const v1::GetPlaceResponse& message) {
  RETURN_IF_ERROR(CheckLength("content_id", message.content_id(), kMaxContentIdBytes));
  ASSIGN_OR_RETURN(const auto place, PlaceFromProto(message.place()));
  ASSIGN_OR_RETURN(auto descriptor, FromProto(message.descriptors()));
  PlaceDetails details{message.content_id(), place, std::move(descriptor.descriptor)};
  if (message.place().has_geo()) {
    ASSIGN_OR_RETURN(details.geo, GeoPoseFromProto("place.geo", message.place().geo()));
  }
  return details;
}

v1::GetPlaceResponse ToProto(const PlaceDetails& details) {
  v1::GetPlaceResponse message;
  message.set_content_id(details.content_id);
  *message.mutable_place() = PlaceToProto(details.place, details.geo ? &*details.geo : nullptr);
  *message.mutable_descriptors() = ToProto(SignedDescriptor{"", details.descriptor});
  return message;
}

absl::StatusOr<ConfusablePairs> FromProto(const v1::ListConfusablePairsResponse& message) {
  absl::Status status = CheckLength("content_id", message.content_id(), kMaxContentIdBytes);
  status.Update(CheckRange("the number of pairs", message.pairs_size(), 0, kMaxPairs));
  ConfusablePairs result{.content_id = message.content_id(), .pairs = {}};
  constexpr auto kMaxPlace = static_cast<double>(limits::kMaxPlaces);
  for (const v1::ConfusablePair& pair : message.pairs()) {
    status.Update(CheckRange("pairs.place", pair.place(), 0, kMaxPlace));
    status.Update(CheckRange("pairs.lookalike", pair.lookalike(), 0, kMaxPlace));
    status.Update(CheckRange("pairs.confidence", pair.confidence(), 0.0, 1.0));
    if (!status.ok()) return status;
    result.pairs.push_back({pair.place(), pair.lookalike(), pair.confidence()});
  }
  if (!status.ok()) return status;
  return result;
}

v1::ListConfusablePairsResponse ToProto(const ConfusablePairs& pairs) {
  v1::ListConfusablePairsResponse message;
  message.set_content_id(pairs.content_id);
  for (const ConfusablePair& pair : pairs.pairs) {
    if (message.pairs_size() == kMaxPairs) break;
    v1::ConfusablePair& one = *message.add_pairs();
    one.set_place(pair.place);
    one.set_lookalike(pair.lookalike);
    one.set_confidence(pair.confidence);
  }
  return message;
}

absl::StatusOr<PlaceUsePage> FromProto(const v1::ListPlaceUseResponse& message) {
  absl::Status status = CheckLength("content_id", message.content_id(), kMaxContentIdBytes);
  status.Update(CheckRange("the number of places", message.places_size(), 0, kMaxPlacesPerPage));
  constexpr auto kMaxPlace = static_cast<double>(limits::kMaxPlaces);
  status.Update(CheckRange("next_place", message.next_place(), 0, kMaxPlace));
  PlaceUsePage page{.use = {.content_id = message.content_id(),
                            .since_ns = message.since_ns(),
                            .until_ns = message.until_ns(),
                            .num_localized = message.num_localized(),
                            .num_ambiguous = message.num_ambiguous(),
                            .num_not_recognized = message.num_not_recognized(),
                            .num_insufficient = message.num_insufficient_scan(),
                            .num_refused_nowhere = message.num_refused_nowhere()},
                    .next_place = message.next_place()};
  for (const v1::PlaceUse& place : message.places()) {
    status.Update(CheckRange("places.place", place.place(), 0, kMaxPlace));
    const PlaceUse use{.num_found = place.num_found(),
                       .num_refused = place.num_refused(),
                       .confidence = place.confidence(),
                       .disagreement = place.disagreement(),
                       .recent_disagreement = place.recent_disagreement(),
                       .last_found_ns = place.last_found_ns(),
                       .last_refused_ns = place.last_refused_ns()};
    status.Update(Validate(use));
    if (!status.ok()) return status;
    page.use.places[place.place()] = use;
  }
  status.Update(Validate(page.use));
  if (!status.ok()) return status;
  return page;
}

v1::ListPlaceUseResponse ToProto(const PlaceUsePage& page) {
  v1::ListPlaceUseResponse message;
  message.set_content_id(page.use.content_id);
  message.set_since_ns(page.use.since_ns);
  message.set_until_ns(page.use.until_ns);
  message.set_num_localized(page.use.num_localized);
  message.set_num_ambiguous(page.use.num_ambiguous);
  message.set_num_not_recognized(page.use.num_not_recognized);
  message.set_num_insufficient_scan(page.use.num_insufficient);
  message.set_num_refused_nowhere(page.use.num_refused_nowhere);
  for (const auto& [place, use] : page.use.places) {
    v1::PlaceUse& one = *message.add_places();
    one.set_place(place);
    one.set_num_found(use.num_found);
    one.set_num_refused(use.num_refused);
    one.set_confidence(use.confidence);
    one.set_disagreement(use.disagreement);
    one.set_recent_disagreement(use.recent_disagreement);
    one.set_last_found_ns(use.last_found_ns);
    one.set_last_refused_ns(use.last_refused_ns);
  }
  message.set_next_place(page.next_place);
  return message;
}

absl::StatusOr<AnswersPage> FromProto(const v1::ListAnswersResponse& message) {
  absl::Status status = CheckLength("run", message.run(), limits::kMaxNameBytes);
  status.Update(CheckRange("the number of answers", message.answers_size(), 0, kMaxAnswersPerPage));
  if (!status.ok()) return status;
  AnswersPage page{.run = message.run(), .answers = {}, .next_after = message.next_after()};
  page.answers.reserve(message.answers_size());
  for (const v1::SeenAnswer& answer : message.answers()) {
    ASSIGN_OR_RETURN(auto seen, SeenFromProto(answer));
    page.answers.push_back(std::move(seen));
  }
  return page;
}

v1::SeenAnswer ToProto(const SeenAnswer& seen) {
  v1::SeenAnswer message;
  message.set_number(seen.number);
  message.set_answered_ns(seen.answered_ns);
  message.set_request_id(seen.request_id);
  message.set_client(seen.client);
  *message.mutable_answer() = ToProto(seen.reply);
  if (!seen.structure.posts.empty()) {
    *message.mutable_structure() = StructureToProto(seen.structure);
    message.mutable_structure()->clear_heights_u32le();
    *message.mutable_t_query_structure() = PoseToProto(seen.T_query_structure);
  }
  message.set_is_of_stream(seen.is_of_stream);
  return message;
}

}  // namespace proto
}  // namespace scanloc
