#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "scanloc/core/answer.hpp"

namespace scanloc {

/// How one place of a map fared in use.
struct PlaceUse {
  std::int64_t num_found = 0;    ///< answers "localized" at it
  std::int64_t num_refused = 0;  ///< queries without a place that it was the likeliest of
  /// Of the answers that found it, on the average: their confidence, and the share of the upright
  /// structure that did not agree. 0 without any.
  double confidence = 0.0;
  double disagreement = 0.0;
  double recent_disagreement = 0.0;  ///< likewise, with the last eight or so weighing most
  std::int64_t last_found_ns = 0;    ///< since 1970; 0: never
  std::int64_t last_refused_ns = 0;

  friend bool operator==(const PlaceUse&, const PlaceUse&) = default;
};

/// How a map fared, counted from the answers of `auto`: where it ages. Holds no scans, and no more
/// than the map has places.
struct MapUse {
  std::string content_id;     ///< of the map that the places are of
  std::int64_t since_ns = 0;  ///< of the first and the last answer, since 1970; 0 without any
  std::int64_t until_ns = 0;
  std::int64_t num_localized = 0;
  std::int64_t num_ambiguous = 0;
  std::int64_t num_not_recognized = 0;
  std::int64_t num_insufficient = 0;
  std::int64_t num_refused_nowhere = 0;  ///< refused, and no place could be named
  std::map<std::int32_t, PlaceUse> places;

  friend bool operator==(const MapUse&, const MapUse&) = default;
};

/// InvalidArgument: a number that cannot be counted so, named.
[[nodiscard]] absl::Status Validate(const PlaceUse& use);
[[nodiscard]] absl::Status Validate(const MapUse& use);

/// The same without the places.
[[nodiscard]] MapUse TotalsOf(const MapUse& use);

/// Counts an answer of `auto` given at that time. last_found is the place where the robot that asks
/// was last localized, if that is known: a query that is refused without a candidate is its.
void Count(const Answer& answer, std::optional<std::int32_t> last_found, std::int64_t now_ns,
           MapUse& use);

/// How much a place is in trouble, in [0, 1]: the share of refused queries, or what lately
/// disagreed, whichever is more.
[[nodiscard]] double TroubleOf(const PlaceUse& use);

}  // namespace scanloc
