#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "scanloc/core/scan/pose.hpp"
#include "scanloc/report/json.hpp"

namespace scanloc::report {

/// One place of a map, or scan of a drive, and whether the other side sees the same there.
struct ReportedChange {
  std::size_t number = 0;  ///< of the place in its map, of the scan in its drive
  std::string scan;
  std::string session;  ///< empty: a drive
  Pose T_map_scan = Pose::Identity();
  std::string change;  ///< same, changed or unseen
  double agreement = 0.0;
};

/// The two sides of a comparison, each with what it is called.
struct ChangeReport {
  std::string before_name;
  std::string after_name;
  std::vector<ReportedChange> before;  ///< of the map
  std::vector<ReportedChange> after;   ///< of the other map, or the drive
};

[[nodiscard]] std::string ChangesAsText(const ChangeReport& report);
[[nodiscard]] Json ChangesAsJson(const ChangeReport& report);
/// A FeatureCollection of points; coordinates are those of the map frame [m].
[[nodiscard]] Json ChangesAsGeoJson(const ChangeReport& report);
/// An SVG document: seen from above.
[[nodiscard]] std::string DrawChanges(const ChangeReport& report);

}  // namespace scanloc::report
