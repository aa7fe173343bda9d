#pragma once

#include <string>
#include <vector>

#include "place_tiles.hpp"
#include "scanloc/proto/messages.hpp"
#include "scanloc/proto/viewer.hpp"
#include "scanloc/report/answer_json.hpp"

/// What the interface tells, as openapi.json describes it.
namespace scanloc::web {

using report::Json;

[[nodiscard]] Json ToJson(const MapSummary& map);
[[nodiscard]] Json ToJson(const MapInfo& info);
[[nodiscard]] Json ToJson(const PlacesPage& page);
[[nodiscard]] Json ToJson(std::int32_t index, const PlaceDetails& details);
/// Pairs whose places the tiles do not have are left out.
[[nodiscard]] Json ToJson(const ConfusablePairs& pairs, const PlaceTiles& tiles);
[[nodiscard]] Json ToJson(const PlaceTiles& tiles);
[[nodiscard]] Json ToJson(const LocalizeReply& reply);
[[nodiscard]] Json ToJson(const SeenAnswer& answer);

/// x, y of post after post [cm], in the frame that T_frame_structure leads to.
[[nodiscard]] Json PostsToJson(const Structure& structure,
                               const Pose& T_frame_structure = Pose::Identity());

/// In one line, whatever texts it holds.
[[nodiscard]] std::string ToLine(const Json& json);

}  // namespace scanloc::web
