#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "scanloc/core/map/map.hpp"
#include "scanloc/proto/viewer.hpp"
#include "scanloc/v1/viewer.pb.h"

namespace scanloc {

/// NotFound: the map has no such place.
[[nodiscard]] absl::StatusOr<PlaceDetails> DetailsOf(const Map& map, std::int32_t place);

namespace proto {

/// As those of convert.hpp: what FromProto gives is in range.
[[nodiscard]] absl::StatusOr<PlaceDetails> FromProto(const v1::GetPlaceResponse& message);
[[nodiscard]] v1::GetPlaceResponse ToProto(const PlaceDetails& details);

[[nodiscard]] absl::StatusOr<ConfusablePairs> FromProto(
    const v1::ListConfusablePairsResponse& message);
[[nodiscard]] v1::ListConfusablePairsResponse ToProto(const ConfusablePairs& pairs);

[[nodiscard]] absl::StatusOr<AnswersPage> FromProto(const v1::ListAnswersResponse& message);
[[nodiscard]] v1::SeenAnswer ToProto(const SeenAnswer& answer);

}  // namespace proto
}  // namespace scanloc
