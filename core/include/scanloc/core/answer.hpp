#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scanloc/core/map/geo_origin.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/pose_covariance.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"

namespace scanloc {

struct Map;

enum class Outcome : std::uint8_t {  // on the wire, never renumber
  kLocalized = 1,
  kAmbiguous = 2,         ///< two distinct places explain the scan
  kNotRecognized = 3,     ///< no place is near enough: out of the map, or changed too much
  kInsufficientScan = 4,  ///< too few points in range to say anything
};

/// `localized`, `ambiguous`, `not_recognized` or `insufficient_scan`.
[[nodiscard]] const char* OutcomeName(Outcome outcome);

/// One place that the scan may have been taken at.
struct Candidate {
  std::int32_t place = 0;  ///< index in the map, 0-based, in the order built
  /// The place that the scan was laid on, which T_map_query comes from; with `auto` another may
  /// stand nearer to it.
  std::int32_t matched = 0;
  std::int32_t session = 0;  ///< index of its session in the map
  std::string session_name;
  std::string map;  ///< its map's name where several were asked (AmongMaps), else empty
  Pose T_map_place = Pose::Identity();
  /// In [0, 1]: of the descriptors, D; with `auto`, the share of the upright structure of query and
  /// place that does not agree.
  double distance = 1.0;
  /// Probability that T_map_query is right (PoseLimits), in [0, 1]; only `auto` tells one.
  std::optional<double> confidence;
  double yaw_rad = 0.0;    ///< heading of the query in the place frame, (-π, π]
  double lateral_m = 0.0;  ///< displacement of the query along the place's +y
  /// T_map_place · Trans(0, lateral_m, 0) · RotZ(yaw_rad); with `auto`, registered in all six
  /// degrees of freedom.
  Pose T_map_query = Pose::Identity();
  /// Of T_map_query, if it is right; only `auto` tells one.
  std::optional<PoseCovariance> covariance;
  /// T_map_query on earth, told by who knows where the map stands there (geo::TellOnEarth).
  std::optional<GeoPose> geo;
};

/// The query taken to stand where a place was mapped; its distance is left open.
[[nodiscard]] Candidate CandidateOf(const Map& map, std::size_t place);

/// Time spent per stage [ns]; zero where it was not measured.
struct StageTimes {
  std::int64_t describe_ns = 0;
  std::int64_t retrieve_ns = 0;
  std::int64_t match_ns = 0;
  std::int64_t verify_ns = 0;
};

/// What is said to one query.
struct Answer {
  Outcome outcome = Outcome::kNotRecognized;
  std::string reason;                 ///< why this outcome, for a person
  std::vector<Candidate> candidates;  ///< best first
  std::string content_id;             ///< of the map that gave the answer
  StageTimes times;
  /// Of all spots that `auto` looked at, 1 - distance, best first; for who weighs several answers.
  std::vector<double> spot_scores = {};
};

/// Makes T_map_query of every candidate that of the base: the answer was to a scan in the turned
/// frame of the mount. Yaw and lateral displacement stay those of the sensor.
void TellOfBase(const SensorMount& mount, Answer& answer);

}  // namespace scanloc
