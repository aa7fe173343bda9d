#include "scanloc/proto/convert_viewer.hpp"

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "fields.hpp"
#include "scanloc/core/limits.hpp"
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
  if (auto status = map.payload->Read(ids, SearchControl(), payloads); !status.ok()) return status;
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
    if (auto status = ReadOwn(map, place, &details.descriptor); !status.ok()) return status;
    return details;
  }
  details.descriptor.polar = OwnContext(map.polar, place);
  details.descriptor.cart = OwnContext(map.cart, place);
  if (!map.structures.empty()) details.descriptor.structure = map.structures[place];
  return details;
}

namespace proto {
namespace {

absl::StatusOr<Place> PlaceFromProto(const v1::Place& message) {
  const auto T_map_place = PoseFromProto("place.T_map_place", message.t_map_place());
  if (!T_map_place.ok()) return T_map_place.status();
  if (auto status = CheckRange("place.session", message.session(), 0,
                               static_cast<double>(limits::kMaxSessions));
      !status.ok()) {
    return status;
  }
  return page;
}

absl::StatusOr<SeenAnswer> SeenFromProto(const v1::SeenAnswer& message) {
  absl::Status status = CheckLength("request_id", message.request_id(), limits::kMaxNameBytes);
  status.Update(CheckLength("client", message.client(), kMaxReasonBytes));
  if (!status.ok()) return status;
  auto reply = FromProto(message.answer());
namespace proto {
namespace {

  if (!reply.ok()) return reply.status();
  SeenAnswer seen{.number = message.number(),
                  .answered_ns = message.answered_ns(),
                  .request_id = message.request_id(),
                  .client = message.client(),
                  .reply = *std::move(reply),
                  .structure = {},
                  .is_of_stream = message.is_of_stream()};
  if (!message.has_structure()) return seen;
  auto structure = StructureFromProto(message.structure());
  if (!structure.ok()) return structure.status();
  seen.structure = *std::move(structure);
  const auto T_query_structure = PoseFromProto("T_query_structure", message.t_query_structure());
  if (!T_query_structure.ok()) return T_query_structure.status();
  seen.T_query_structure = *T_query_structure;
  return seen;
}

}  // namespace

absl::StatusOr<PlaceDetails> FromProto(const v1::GetPlaceResponse& message) {
  if (auto status = CheckLength("content_id", message.content_id(), kMaxContentIdBytes);
      !status.ok()) {
    return status;
  }
  const auto place = PlaceFromProto(message.place());
  if (!place.ok()) return place.status();
  auto descriptor = FromProto(message.descriptors());
  if (!descriptor.ok()) return descriptor.status();
  PlaceDetails details{message.content_id(), *place, std::move(descriptor->descriptor)};
  if (message.place().has_geo()) {
    const auto geo = GeoPoseFromProto("place.geo", message.place().geo());
    if (!geo.ok()) return geo.status();
    details.geo = *geo;
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

absl::StatusOr<AnswersPage> FromProto(const v1::ListAnswersResponse& message) {
  absl::Status status = CheckLength("run", message.run(), limits::kMaxNameBytes);
  status.Update(CheckRange("the number of answers", message.answers_size(), 0, kMaxAnswersPerPage));
  if (!status.ok()) return status;
  AnswersPage page{.run = message.run(), .answers = {}, .next_after = message.next_after()};
  page.answers.reserve(message.answers_size());
  for (const v1::SeenAnswer& answer : message.answers()) {
    auto seen = SeenFromProto(answer);
    if (!seen.ok()) return seen.status();
    page.answers.push_back(*std::move(seen));
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
    *message.mutable_t_query_structure() = PoseToProto(seen.T_query_structure);
  }
  message.set_is_of_stream(seen.is_of_stream);
  return message;
}

}  // namespace proto
}  // namespace scanloc
