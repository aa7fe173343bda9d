#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/answer.hpp"
#include "scanloc/core/map/geo_origin.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/prior.hpp"
#include "scanloc/core/scan/pose.hpp"

/// Map frames on earth; by GeographicLib (Karney), to some nanometres.
namespace scanloc::geo {

/// WGS 84; altitude above the ellipsoid.
struct GeoPosition {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double altitude_m = 0.0;
};

/// A map frame and where it stands. Safe to use from several threads.
class GeoFrame {
 public:
  /// InvalidArgument: as Validate of the origin.
  [[nodiscard]] static absl::StatusOr<GeoFrame> Create(const GeoOrigin& origin);

  [[nodiscard]] GeoPosition ToGeo(const Eigen::Vector3d& at_map_m) const;
  /// With the heading against true north there, which turns from place to place.
  [[nodiscard]] GeoPose ToGeo(const Pose& T_map_x) const;
  [[nodiscard]] std::vector<GeoPose> ToGeo(const std::vector<Place>& places) const;
  [[nodiscard]] Eigen::Vector3d ToMap(const GeoPosition& position) const;
  /// In the plane at the origin's altitude. Of what lies beyond the origin's horizon the middle is
  /// told to be in its direction, 10,000 km off.
  [[nodiscard]] Prior::Disc ToMap(const Prior::GeoDisc& disc) const;

 private:
  struct Impl;
  explicit GeoFrame(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<const Impl> impl_;
};

/// The prior in the frame of a map that stands there: its disc on earth has become one of the map.
/// FailedPrecondition: it has one, and the map does not know where it stands.
[[nodiscard]] absl::StatusOr<Prior> InMapFrame(const Prior& prior,
                                               const std::optional<GeoFrame>& frame);

/// Tells of each candidate where its T_map_query is on earth; without a frame nothing.
void TellOnEarth(const std::optional<GeoFrame>& frame, Answer& answer);

/// `32n 691603.123 5334763.456`: zone and hemisphere, easting and northing [m]; near the poles UPS.
[[nodiscard]] std::string UtmText(const GeoPosition& position);
/// `32UPU9160034763`: to the metre.
[[nodiscard]] std::string MgrsText(const GeoPosition& position);

}  // namespace scanloc::geo
