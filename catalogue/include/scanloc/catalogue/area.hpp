#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

/// Where the places of a map are. Pure functions; thread-safe.
namespace scanloc::catalogue {

struct Corner {
  double x = 0.0;
  double y = 0.0;

  friend bool operator==(const Corner&, const Corner&) = default;
};

/// A polygon, closed by itself, its corners in either sense. Where edges cross, inside is what lies
/// within an odd number of turns. One corner is a point, two are a line.
struct Area {
  static constexpr std::size_t kMaxCorners = 10'000;

  std::vector<Corner> corners = {{}};
  /// Corners are longitude and latitude [deg], WGS 84; else x and y of the map frame [m].
  bool is_on_earth = false;

  friend bool operator==(const Area&, const Area&) = default;
};

/// OK, or InvalidArgument: no corner or too many, or one that is nowhere.
[[nodiscard]] absl::Status Validate(const Area& area);

/// With edges along x and y.
struct Box {
  double min_x, min_y, max_x, max_y;
};
[[nodiscard]] std::vector<Corner> CornersOf(const Box& box);
/// Requires a corner.
[[nodiscard]] Box BoxOf(const Area& area);

/// The corners of the smallest convex polygon round the points, counter-clockwise; none of none.
[[nodiscard]] std::vector<Corner> ConvexHull(std::vector<Corner> points);

/// Between their nearest points; 0 where they overlap. On earth it is up to 1 % short where it is
/// small against the radius of the earth. Infinite where one is on earth and the other is not.
[[nodiscard]] double Distance_m(const Area& a, const Area& b);

/// GeoJSON (RFC 7946): a Polygon without holes, a Feature of one, or a FeatureCollection of one of
/// these. InvalidArgument: something else, said what.
[[nodiscard]] absl::StatusOr<Area> AreaFromGeoJson(const std::string& text);

}  // namespace scanloc::catalogue
