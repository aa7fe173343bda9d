#include "fields.hpp"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::proto {

absl::Status CheckLength(absl::string_view field, const std::string& text, std::size_t max_bytes) {
  if (text.size() <= max_bytes) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " has ", text.size(), " bytes; at most ", max_bytes, " are allowed"));
}

absl::Status CheckFinite(absl::string_view field, double value) {
  if (std::isfinite(value)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", value, "; it must be a finite number"));
}

absl::Status CheckRange(absl::string_view field, double value, double low, double high) {
  if (value >= low && value <= high) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", value, "; it must lie in [", low, ", ", high, "]"));
}

absl::Status CheckEnum(absl::string_view field, int value, int max) {
  if (value > 0 && value <= max) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(field, " is ", value, ", which is none"));
}

absl::StatusOr<Pose> PoseFromProto(absl::string_view field, const v1::Pose& message) {
  auto pose = PoseFromQuaternion({message.x_m(), message.y_m(), message.z_m()},
                                 {message.qw(), message.qx(), message.qy(), message.qz()});
  if (!pose.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(field, ": ", pose.status().message()));
  }
  return pose;
}

v1::Pose PoseToProto(const Pose& pose) {
  const Eigen::Quaterniond rotation(pose.linear());
  v1::Pose message;
  message.set_x_m(pose.translation().x());
  message.set_y_m(pose.translation().y());
  message.set_z_m(pose.translation().z());
  message.set_qx(rotation.x());
  message.set_qy(rotation.y());
  message.set_qz(rotation.z());
  message.set_qw(rotation.w());
  return message;
}

absl::StatusOr<Box> BoxFromProto(absl::string_view field, const v1::Box& message) {
  const Box box{.min_m = {message.min_x_m(), message.min_y_m(), message.min_z_m()},
                .max_m = {message.max_x_m(), message.max_y_m(), message.max_z_m()}};
  absl::Status status;
  for (int axis = 0; axis < 3; ++axis) {
    status.Update(CheckFinite(field, box.min_m[axis]));
    status.Update(CheckFinite(field, box.max_m[axis]));
  }
  if (!status.ok()) return status;
  return box;
}

v1::Box BoxToProto(const Box& box) {
  v1::Box message;
  message.set_min_x_m(box.min_m.x());
  message.set_min_y_m(box.min_m.y());
  message.set_min_z_m(box.min_m.z());
  message.set_max_x_m(box.max_m.x());
  message.set_max_y_m(box.max_m.y());
  message.set_max_z_m(box.max_m.z());
  return message;
}

absl::StatusOr<GeoPose> GeoPoseFromProto(absl::string_view field, const v1::GeoPose& message) {
  const auto named = [field](const char* part) { return absl::StrCat(field, ".", part); };
  absl::Status status = CheckRange(named("latitude_deg"), message.latitude_deg(), -90.0, 90.0);
  status.Update(CheckRange(named("longitude_deg"), message.longitude_deg(), -180.0, 180.0));
  status.Update(CheckFinite(named("altitude_m"), message.altitude_m()));
  status.Update(CheckRange(named("heading_deg"), message.heading_deg(), 0.0, 360.0));
  if (!status.ok()) return status;
  return GeoPose{message.latitude_deg(), message.longitude_deg(), message.altitude_m(),
                 message.heading_deg()};
}

v1::GeoPose GeoPoseToProto(const GeoPose& pose) {
  v1::GeoPose message;
  message.set_latitude_deg(pose.latitude_deg);
  message.set_longitude_deg(pose.longitude_deg);
  message.set_altitude_m(pose.altitude_m);
  message.set_heading_deg(pose.heading_deg);
  return message;
}

absl::StatusOr<Place> PlaceFromProto(const v1::Place& message) {
  ASSIGN_OR_RETURN(const auto T_map_place,
                   PoseFromProto("place.T_map_place", message.t_map_place()));
  RETURN_IF_ERROR(
      CheckRange("place.session", message.session(), 0, static_cast<double>(limits::kMaxSessions)));
  return Place{T_map_place, message.stamp_ns(), message.session()};
}

v1::Place PlaceToProto(const Place& place, const GeoPose* geo) {
  v1::Place message;
  *message.mutable_t_map_place() = PoseToProto(place.T_map_place);
  message.set_session(place.session);
  message.set_stamp_ns(place.stamp_ns);
  if (geo != nullptr) *message.mutable_geo() = GeoPoseToProto(*geo);
  return message;
}

}  // namespace scanloc::proto
