#include "scanloc/geo/geo_frame.hpp"

#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/MGRS.hpp>
#include <GeographicLib/UTMUPS.hpp>
#include <cmath>
#include <numbers>

#include "absl/strings/str_format.h"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::geo {
namespace {

struct Grid {
  int zone = 0;
  bool is_north = false;
  double easting_m = 0.0;
  double northing_m = 0.0;
};

Grid GridOf(const GeoPosition& position) {
  Grid grid;
  GeographicLib::UTMUPS::Forward(position.latitude_deg, position.longitude_deg, grid.zone,
                                 grid.is_north, grid.easting_m, grid.northing_m);
  return grid;
}

}  // namespace

struct GeoFrame::Impl {
  GeographicLib::LocalCartesian east_north_up;
  Eigen::Matrix2d R_east_map;
  Eigen::Vector3d anchor_m;
};

absl::StatusOr<GeoFrame> GeoFrame::Create(const GeoOrigin& origin) {
  RETURN_IF_ERROR(Validate(origin));
  const double heading = origin.heading_deg * std::numbers::pi / 180.0;
  // Exact where the axes are those of the compass.
  const double quarters = origin.heading_deg / 90.0;
  const bool is_quarter = quarters == std::round(quarters);
  const double sine = is_quarter ? std::round(std::sin(heading)) : std::sin(heading);
  const double cosine = is_quarter ? std::round(std::cos(heading)) : std::cos(heading);
  Eigen::Matrix2d R_east_map;
  R_east_map << sine, -cosine, cosine, sine;
  return GeoFrame(std::make_shared<const Impl>(Impl{
      GeographicLib::LocalCartesian(origin.latitude_deg, origin.longitude_deg, origin.altitude_m),
      R_east_map, origin.anchor_m}));
}

GeoPosition GeoFrame::ToGeo(const Eigen::Vector3d& at_map_m) const {
  const Eigen::Vector3d offset = at_map_m - impl_->anchor_m;
  const Eigen::Vector2d east_north = impl_->R_east_map * offset.head<2>();
  GeoPosition position;
  impl_->east_north_up.Reverse(east_north.x(), east_north.y(), offset.z(), position.latitude_deg,
                               position.longitude_deg, position.altitude_m);
  return position;
}

GeoPose GeoFrame::ToGeo(const Pose& T_map_x) const {
  const Eigen::Vector3d offset = T_map_x.translation() - impl_->anchor_m;
  const Eigen::Vector2d east_north = impl_->R_east_map * offset.head<2>();
  GeoPose pose;
  std::vector<GeographicLib::Math::real> rows(
      9);  // of what turns local axes there into the origin's
  impl_->east_north_up.Reverse(east_north.x(), east_north.y(), offset.z(), pose.latitude_deg,
                               pose.longitude_deg, pose.altitude_m, rows);
  const Eigen::Matrix3d R_origin_local =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data());
  Eigen::Vector3d ahead = T_map_x.linear().col(0);
  ahead.head<2>() = impl_->R_east_map * ahead.head<2>().eval();
  const Eigen::Vector3d local = R_origin_local.transpose() * ahead;
  const double heading = std::atan2(local.x(), local.y()) * 180.0 / std::numbers::pi;
  pose.heading_deg = heading < 0.0 ? heading + 360.0 : heading;
  if (pose.heading_deg >= 360.0) pose.heading_deg = 0.0;  // a hair west of north, rounded
  return pose;
}

std::vector<GeoPose> GeoFrame::ToGeo(const std::vector<Place>& places) const {
  std::vector<GeoPose> poses;
  poses.reserve(places.size());
  for (const Place& place : places) poses.push_back(ToGeo(place.T_map_place));
  return poses;
}

Eigen::Vector3d GeoFrame::ToMap(const GeoPosition& position) const {
  Eigen::Vector3d offset;
  impl_->east_north_up.Forward(position.latitude_deg, position.longitude_deg, position.altitude_m,
                               offset.x(), offset.y(), offset.z());
  offset.head<2>() = impl_->R_east_map.transpose() * offset.head<2>().eval();
  return impl_->anchor_m + offset;
}

Prior::Disc GeoFrame::ToMap(const Prior::GeoDisc& disc) const {
  constexpr double kFar_m = 1e7;
  const Eigen::Vector3d offset = ToMap(GeoPosition{disc.latitude_deg, disc.longitude_deg,
                                                   impl_->east_north_up.HeightOrigin()}) -
                                 impl_->anchor_m;
  Eigen::Vector2d plane = offset.head<2>();
  // Beyond, what lies farther off would come nearer again in the plane.
  if (-offset.z() > plane.norm()) {
    plane = plane.norm() > 0.0 ? Eigen::Vector2d(plane.normalized() * kFar_m)
                               : Eigen::Vector2d(kFar_m, 0.0);
  }
  plane += impl_->anchor_m.head<2>();
  return {.x_m = plane.x(), .y_m = plane.y(), .radius_m = disc.radius_m};
}

absl::StatusOr<Prior> InMapFrame(const Prior& prior, const std::optional<GeoFrame>& frame) {
  if (!prior.on_earth) return prior;
  if (!frame) {
    return absl::FailedPreconditionError(
        "the prior is a place on earth, and the map does not know where on earth it stands "
        "(scanloc edit --geo-origin)");
  }
  Prior in_map = prior;
  in_map.disc = frame->ToMap(*prior.on_earth);
  in_map.on_earth.reset();
  return in_map;
}

void TellOnEarth(const std::optional<GeoFrame>& frame, Answer& answer) {
  if (!frame) return;
  for (Candidate& candidate : answer.candidates)
    candidate.geo = frame->ToGeo(candidate.T_map_query);
}

std::string UtmText(const GeoPosition& position) {
  const Grid grid = GridOf(position);
  return absl::StrFormat("%s %.3f %.3f",
                         GeographicLib::UTMUPS::EncodeZone(grid.zone, grid.is_north),
                         grid.easting_m, grid.northing_m);
}

std::string MgrsText(const GeoPosition& position) {
  const Grid grid = GridOf(position);
  std::string text;
  GeographicLib::MGRS::Forward(grid.zone, grid.is_north, grid.easting_m, grid.northing_m,
                               position.latitude_deg, 5, text);
  return text;
}

}  // namespace scanloc::geo
