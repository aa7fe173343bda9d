#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace scanloc {

/// Where a query was taken, as far as whoever asks knows: places elsewhere, and rivals there, are
/// not looked at. A value; what is left open restricts nothing. Coordinates are those of the map.
struct Prior {
  struct Disc {
    double x_m = 0.0;
    double y_m = 0.0;
    double radius_m = 0.0;  ///< above 0; to reach the places around the query, not only the query

    friend bool operator==(const Disc&, const Disc&) = default;
  };
  /// Heights of the sensor, along z; one floor, say.
  struct Heights {
    double min_m = 0.0;
    double max_m = 0.0;

    friend bool operator==(const Heights&, const Heights&) = default;
  };
  /// On earth (WGS 84), for one or several maps that know where they stand.
  struct GeoDisc {
    double latitude_deg = 0.0;
    double longitude_deg = 0.0;
    double radius_m = 0.0;  ///< as of Disc

    friend bool operator==(const GeoDisc&, const GeoDisc&) = default;
  };
  std::optional<Disc> disc = {};
  std::optional<Heights> heights = {};
  std::vector<std::string> sessions = {};  ///< by name; empty: all

  /// In place of disc: geo::InMapFrame makes that of it, before a map is searched.
  std::optional<GeoDisc> on_earth = {};

  [[nodiscard]] bool is_open() const { return !disc && !heights && sessions.empty() && !on_earth; }

  friend bool operator==(const Prior&, const Prior&) = default;
};

/// OK, or InvalidArgument that names what is out of range.
[[nodiscard]] absl::Status Validate(const Prior& prior);

}  // namespace scanloc
