#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "scanloc/core/map/map.hpp"
#include "scanloc/proto/viewer.hpp"
#include "scanloc/v1/viewer.pb.h"

namespace scanloc {

/// NotFound: the map has no such place.
[[nodiscard]] absl::StatusOr<PlaceDetails> DetailsOf(const Map& map, std::int32_t place);

/// The page from that place on; max_places 0 stands for the most, kMaxPlacesPerPage.
/// InvalidArgument: a bad number.
[[nodiscard]] absl::StatusOr<PlaceUsePage> PageOfUse(const MapUse& use, std::int32_t first_place,
                                                     int max_places);

namespace proto {

/// As those of convert.hpp: what FromProto gives is in range.
[[nodiscard]] absl::StatusOr<PlaceDetails> FromProto(const v1::GetPlaceResponse& message);
[[nodiscard]] v1::GetPlaceResponse ToProto(const PlaceDetails& details);

[[nodiscard]] absl::StatusOr<ConfusablePairs> FromProto(
    const v1::ListConfusablePairsResponse& message);
[[nodiscard]] v1::ListConfusablePairsResponse ToProto(const ConfusablePairs& pairs);

[[nodiscard]] absl::StatusOr<PlaceUsePage> FromProto(const v1::ListPlaceUseResponse& message);
[[nodiscard]] v1::ListPlaceUseResponse ToProto(const PlaceUsePage& page);

[[nodiscard]] absl::StatusOr<AnswersPage> FromProto(const v1::ListAnswersResponse& message);
[[nodiscard]] v1::SeenAnswer ToProto(const SeenAnswer& answer);

}  // namespace proto
}  // namespace scanloc
