#include "scanloc/catalogue/area.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::catalogue {
namespace {

using Points = std::vector<Eigen::Vector2d>;

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// A degree of latitude where it is shortest, at the equator.
constexpr double kDegree_m = 110'574.0;

/// Metres on a plane about a point; on earth each corner by its bearing and distance from there,
/// and next to the one before, be the 180th meridian between them.
Points Laid(const Area& area, const Corner& about) {
  Points points;
  double turns_deg = 0.0;
  double last_deg = about.x;
  for (const Corner& corner : area.corners) {
    if (!area.is_on_earth) {
      points.emplace_back(corner.x - about.x, corner.y - about.y);
      continue;
    }
    turns_deg += std::remainder(corner.x - last_deg, 360.0);
    last_deg = corner.x;
    const double middle_rad = 0.5 * (corner.y + about.y) * std::numbers::pi / 180.0;
    points.emplace_back(kDegree_m * std::cos(middle_rad) * turns_deg,
                        kDegree_m * (corner.y - about.y));
  }
  return points;
}

double FromEdge(const Eigen::Vector2d& point, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double length = along.squaredNorm();
  const double share = length > 0.0 ? std::clamp((point - a).dot(along) / length, 0.0, 1.0) : 0.0;
  return (a + share * along - point).norm();
}

bool AreCrossing(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                 const Eigen::Vector2d& d) {
  return Cross(b - a, c - a) * Cross(b - a, d - a) < 0.0 &&
         Cross(d - c, a - c) * Cross(d - c, b - c) < 0.0;
}

bool IsInside(const Eigen::Vector2d& point, const Points& polygon) {
  bool is_inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    const double x = a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    if (point.x() < x) is_inside = !is_inside;
  }
  return is_inside;
}

double Between(const Points& a, const Points& b) {
  if (IsInside(a.front(), b) || IsInside(b.front(), a)) return 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Eigen::Vector2d& a_end = a[(i + 1) % a.size()];
    for (std::size_t k = 0; k < b.size(); ++k) {
      const Eigen::Vector2d& b_end = b[(k + 1) % b.size()];
      if (AreCrossing(a[i], a_end, b[k], b_end)) return 0.0;
      least = std::min({least, FromEdge(a[i], b[k], b_end), FromEdge(b[k], a[i], a_end)});
    }
  }
  return least;
}

absl::Status BadGeoJson(absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat(
      "the GeoJSON ", why, "; it must be one Polygon without holes, in longitude and latitude"));
}

}  // namespace

absl::Status Validate(const Area& area) {
  if (area.corners.empty() || area.corners.size() > Area::kMaxCorners) {
    return absl::InvalidArgumentError(absl::StrCat(
        "the area has ", area.corners.size(), " corners; it must have 1 to ", Area::kMaxCorners));
  }
  const double most_x = area.is_on_earth ? 180.0 : limits::kMaxTranslation_m;
  const double most_y = area.is_on_earth ? 90.0 : limits::kMaxTranslation_m;
  for (const Corner& corner : area.corners) {
    if (std::abs(corner.x) <= most_x && std::abs(corner.y) <= most_y) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("the area has a corner at (", corner.x, ", ", corner.y, "); it must be ",
                     area.is_on_earth ? "a longitude within ±180 and a latitude within ±90 degrees"
                                      : "within 1e8 m of the map frame's origin"));
  }
  return absl::OkStatus();
}

std::vector<Corner> CornersOf(const Box& box) {
  return {{box.min_x, box.min_y},
          {box.max_x, box.min_y},
          {box.max_x, box.max_y},
          {box.min_x, box.max_y}};
}

Box BoxOf(const Area& area) {
  const Corner& first = area.corners.front();
  Box box{first.x, first.y, first.x, first.y};
  for (const Corner& corner : area.corners) {
    box.min_x = std::min(box.min_x, corner.x);
    box.min_y = std::min(box.min_y, corner.y);
    box.max_x = std::max(box.max_x, corner.x);
    box.max_y = std::max(box.max_y, corner.y);
  }
  return box;
}

// Andrew's monotone chain.
std::vector<Corner> ConvexHull(std::vector<Corner> points) {
  const auto less = [](const Corner& a, const Corner& b) {
    return std::pair(a.x, a.y) < std::pair(b.x, b.y);
  };
  std::ranges::sort(points, less);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  std::vector<Corner> hull;
  const auto add = [&](const Corner& next, std::size_t least) {
    const auto is_left = [&] {
      const Corner& a = hull[hull.size() - 2];
      const Corner& b = hull.back();
      return (b.x - a.x) * (next.y - a.y) - (b.y - a.y) * (next.x - a.x) > 0.0;
    };
    while (hull.size() > least && !is_left()) hull.pop_back();
    hull.push_back(next);
  };
  for (const Corner& point : points) add(point, 1);
  const std::size_t num_below = hull.size();
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], num_below);
  hull.pop_back();
  return hull;
}

double Distance_m(const Area& a, const Area& b) {
  if (a.is_on_earth != b.is_on_earth) return std::numeric_limits<double>::infinity();
  const Corner& about = a.corners.front();
  return Between(Laid(a, about), Laid(b, about));
}

absl::StatusOr<Area> AreaFromGeoJson(const std::string& text) {
  nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  try {
    if (json.is_object() && json.value("type", "") == "FeatureCollection") {
      if (json.at("features").size() != 1) return BadGeoJson("has not one feature");
      json = nlohmann::json(json.at("features").at(0));
    }
    if (json.is_object() && json.value("type", "") == "Feature") {
      json = nlohmann::json(json.at("geometry"));
    }
    if (!json.is_object() || json.value("type", "") != "Polygon") {
      return BadGeoJson("has no Polygon");
    }
    const nlohmann::json& rings = json.at("coordinates");
    if (rings.size() != 1) return BadGeoJson("has a Polygon with holes, or without a ring");
    Area area{.corners = {}, .is_on_earth = true};
    for (const nlohmann::json& corner : rings.at(0)) {
      area.corners.push_back({corner.at(0).get<double>(), corner.at(1).get<double>()});
    }
    if (area.corners.size() < 4 || area.corners.front() != area.corners.back()) {
      return BadGeoJson("has a ring that is not closed, or of fewer than four positions");
    }
    area.corners.pop_back();
    RETURN_IF_ERROR(Validate(area));
    return area;
  } catch (const nlohmann::json::exception& error) {
    return BadGeoJson(absl::StrCat("cannot be read: ", error.what()));
  }
}

}  // namespace scanloc::catalogue
