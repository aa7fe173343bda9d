#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/answer.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/query.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/core/scan/voxel_filter.hpp"

/// What goes over the wire beside core's own types, as plain structs.
namespace scanloc {

/// What a server tells of one map.
struct MapInfo {
  std::string name;
  std::string content_id;
  Params params;
  std::vector<std::string> sessions;
  std::int64_t num_places = 0;
  std::optional<Box> extent;     ///< in the map frame, holds every place; none without any
  std::uint64_t generation = 0;  ///< how often a map was put in service under this name, from 1
  std::optional<GeoOrigin> geo_origin = {};  ///< where its frame stands on earth, if that was told

  friend bool operator==(const MapInfo&, const MapInfo&) = default;
};

/// What there is to tell of a map; generation is left 0.
[[nodiscard]] MapInfo InfoOf(const std::string& name, const Map& map);

enum class MapState : std::uint8_t {  // on the wire, never renumber
  kLoading = 1,
  kServing = 2,
  kFailed = 3,  ///< its file could not be loaded
};

/// One line of the list of a server's maps.
struct MapSummary {
  std::string name;
  MapState state = MapState::kLoading;
  std::string content_id;  ///< this and the rest only while serving
  std::int64_t num_places = 0;
  std::uint64_t generation = 0;

  friend bool operator==(const MapSummary&, const MapSummary&) = default;
};

/// Some places of a map, in order of index.
struct PlacesPage {
  std::string content_id;
  std::int32_t first_place = 0;  ///< index in the map of the first of them
  std::vector<Place> places;
  std::string next_page_token;  ///< empty: these were the last
  std::vector<GeoPose> geo;     ///< of each, where the map has a geo_origin; else empty
};

inline constexpr int kMaxPlacesPerPage = 1000;

/// The page that the token names, the first if it is empty; page_size 0 stands for the most.
/// InvalidArgument: a bad size, or a token that no page gave. Aborted: one of another content.
[[nodiscard]] absl::StatusOr<PlacesPage> PageOfPlaces(const Map& map, int page_size,
                                                      const std::string& page_token);

/// Descriptors, and the DescriptorSignature of the parameters they were made with.
struct SignedDescriptor {
  std::string signature;
  ScanDescriptor descriptor;
};

/// What a robot says of a scan, to find the answer to it again.
struct ScanHeader {
  std::int64_t stamp_ns = 0;  ///< 0: not known
  std::string frame_id;       ///< at most limits::kMaxNameBytes

  friend bool operator==(const ScanHeader&, const ScanHeader&) = default;
};

/// What a server says to one query.
struct LocalizeReply {
  Answer answer;
  std::string map;             ///< name of the map that gave the answer; of several, the best
  std::int64_t queue_ns = 0;   ///< waited for a free thread
  std::int64_t decode_ns = 0;  ///< unpacking and checking the request
  std::optional<ScanCounts> scan_counts;  ///< if the query was a scan
  ScanHeader header = {};                 ///< as the query had it
};

/// A query without a place that a server kept for replay.
struct CapturedQuery {
  std::string request_id;
  std::string map;                      ///< as the request named it
  Query query;                          ///< this and the budget as the request had them
  std::chrono::milliseconds budget{0};  ///< 0: none
  PointCloud scan;                      ///< empty if descriptors were sent
  SensorMount mount;                    ///< of the sensor that saw the scan
  ScanHeader header;
  std::optional<SignedDescriptor> descriptor;
  LocalizeReply reply;  ///< what was said to it
};

/// What a server says to one scan of a moving robot.
struct TrackedReply {
  LocalizeReply reply;
  int num_scans = 0;          ///< that the best candidate rests on
  bool is_relocated = false;  ///< as in TrackedAnswer
};

}  // namespace scanloc
