#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scanloc/core/map/map.hpp"
#include "scanloc/core/map_use.hpp"
#include "scanloc/core/scan/structure.hpp"
#include "scanloc/proto/messages.hpp"

/// What people look at (scanloc.v1.Viewer), as plain structs.
namespace scanloc {

/// What a map holds of one place.
struct PlaceDetails {
  std::string content_id;
  Place place;
  ScanDescriptor descriptor;  ///< its own; num_voxels is not known
  std::optional<GeoPose> geo = {};
};

/// Places of a map that look alike, worst first.
struct ConfusablePairs {
  std::string content_id;
  std::vector<ConfusablePair> pairs;
};

/// How some places of a map fared in use, and the map as a whole.
struct PlaceUsePage {
  MapUse use;
  std::int32_t next_place = 0;  ///< where the next page begins; 0: these were the last
};

/// One answer of a server, and who asked.
struct SeenAnswer {
  std::uint64_t number = 0;  ///< from 1, over all maps since the server started
  std::int64_t answered_ns = 0;
  std::string request_id;
  std::string client;
  LocalizeReply reply;
  Structure structure;                        ///< of the scan; thinned where it has many posts
  Pose T_query_structure = Pose::Identity();  ///< but for roll and pitch
  bool is_of_stream = false;
};

struct AnswersPage {
  std::string run;  ///< of the server, since it started
  std::vector<SeenAnswer> answers;
  std::uint64_t next_after = 0;
};

inline constexpr int kMaxPairs = 10'000;
inline constexpr int kMaxAnswersPerPage = 100;
inline constexpr std::size_t kMaxSeenPosts = 2048;
inline constexpr int kMaxSeenCandidates = 5;

}  // namespace scanloc
