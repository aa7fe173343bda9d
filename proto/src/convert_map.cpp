#include <map>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "fields.hpp"
#include "scanloc/core/auto_fields.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/convert.hpp"

namespace scanloc::proto {
namespace {

absl::Status CheckNumPlaces(std::int64_t num_places) {
  return CheckRange("num_places", static_cast<double>(num_places), 0,
                    static_cast<double>(limits::kMaxPlaces));
}

absl::StatusOr<AutoParams> AutoParamsFromProto(const v1::Params& message) {
  std::map<absl::string_view, double> values;
  for (const v1::NamedNumber& number : message.auto_params()) {
    values[number.name()] = number.value();
  }
  AutoParams params;
  absl::Status status;
  VisitAutoFields(params, [&](const char* name, auto& field, auto least, auto most) {
    const auto value = values.find(name);
    if (value == values.end()) {
      status.Update(absl::InvalidArgumentError(absl::StrCat("params lack ", name)));
    } else {
      status.Update(CheckRange(name, value->second, least, most));
      if (status.ok()) field = static_cast<std::remove_reference_t<decltype(field)>>(value->second);
    }
  });
  if (!status.ok()) return status;
  return params;
}

}  // namespace

absl::StatusOr<Params> FromProto(const v1::Params& message) {
  if (!message.has_polar() || !message.has_cart() || !message.has_search() ||
      !message.has_structure()) {
    return absl::InvalidArgumentError("params lack polar, cart, search or structure");
  }
  RETURN_IF_ERROR(
      CheckEnum("params.cart.shift_mode", message.cart().shift_mode(), v1::ShiftMode_MAX));
  ASSIGN_OR_RETURN(auto automatic, AutoParamsFromProto(message));

  const v1::PolarParams& polar = message.polar();
  const v1::CartParams& cart = message.cart();
  const v1::SearchParams& search = message.search();
  Params params{
      .voxel_size_m = message.voxel_size_m(),
      .sensor_height_m = message.sensor_height_m(),
      .polar = {.enabled = polar.enabled(),
                .num_rings = polar.num_rings(),
                .num_sectors = polar.num_sectors(),
                .max_range_m = polar.max_range_m(),
                .root_shifts_m = {polar.root_shifts_m().begin(), polar.root_shifts_m().end()}},
      .cart = {.enabled = cart.enabled(),
               .num_rows = cart.num_rows(),
               .num_cols = cart.num_cols(),
               .max_x_m = cart.max_x_m(),
               .max_y_m = cart.max_y_m(),
               .double_flip = cart.double_flip(),
               .shift_mode = cart.shift_mode() == v1::SHIFT_MODE_BOUNDED ? ShiftMode::kBounded
                                                                         : ShiftMode::kCircular,
               .max_shift_cols = cart.max_shift_cols()},
      .structure = {.enabled = message.structure().enabled()},
      .search = {.num_candidates = search.num_candidates(),
                 .align_radius = search.align_radius(),
                 .polar_threshold = search.polar_threshold(),
                 .cart_threshold = search.cart_threshold(),
                 .min_confidence = search.min_confidence(),
                 .min_voxels = search.min_voxels()},
      .automatic = automatic};
  RETURN_IF_ERROR(Validate(params));
  return params;
}

v1::Params ToProto(const Params& params) {
  v1::Params message;
  message.set_voxel_size_m(params.voxel_size_m);
  message.set_sensor_height_m(params.sensor_height_m);

  v1::PolarParams& polar = *message.mutable_polar();
  polar.set_enabled(params.polar.enabled);
  polar.set_num_rings(params.polar.num_rings);
  polar.set_num_sectors(params.polar.num_sectors);
  polar.set_max_range_m(params.polar.max_range_m);
  polar.mutable_root_shifts_m()->Add(params.polar.root_shifts_m.begin(),
                                     params.polar.root_shifts_m.end());

  v1::CartParams& cart = *message.mutable_cart();
  cart.set_enabled(params.cart.enabled);
  cart.set_num_rows(params.cart.num_rows);
  cart.set_num_cols(params.cart.num_cols);
  cart.set_max_x_m(params.cart.max_x_m);
  cart.set_max_y_m(params.cart.max_y_m);
  cart.set_double_flip(params.cart.double_flip);
  cart.set_shift_mode(params.cart.shift_mode == ShiftMode::kBounded ? v1::SHIFT_MODE_BOUNDED
                                                                    : v1::SHIFT_MODE_CIRCULAR);
  cart.set_max_shift_cols(params.cart.max_shift_cols);

  v1::SearchParams& search = *message.mutable_search();
  search.set_num_candidates(params.search.num_candidates);
  search.set_align_radius(params.search.align_radius);
  search.set_polar_threshold(params.search.polar_threshold);
  search.set_cart_threshold(params.search.cart_threshold);
  search.set_min_confidence(params.search.min_confidence);
  search.set_min_voxels(params.search.min_voxels);

  message.mutable_structure()->set_enabled(params.structure.enabled);
  VisitAutoFields(params.automatic,
                  [&](const char* name, auto field, auto /*least*/, auto /*most*/) {
                    v1::NamedNumber& number = *message.add_auto_params();
                    number.set_name(name);
                    number.set_value(field);
                  });
  return message;
}

absl::StatusOr<MapInfo> FromProto(const v1::MapInfo& message) {
  absl::Status status = CheckAskedMap(message.name());
  status.Update(CheckLength("content_id", message.content_id(), kMaxContentIdBytes));
  status.Update(CheckNumPlaces(message.num_places()));
  status.Update(CheckRange("the number of sessions", message.sessions_size(), 0,
                           static_cast<double>(limits::kMaxSessions)));
  for (const std::string& session : message.sessions()) {
    status.Update(CheckLength("sessions", session, limits::kMaxNameBytes));
  }
  if (!status.ok()) return status;
  ASSIGN_OR_RETURN(auto params, FromProto(message.params()));

  MapInfo info;
  info.name = message.name();
  info.content_id = message.content_id();
  info.params = std::move(params);
  info.sessions.assign(message.sessions().begin(), message.sessions().end());
  info.num_places = message.num_places();
  if (message.has_extent()) {
    ASSIGN_OR_RETURN(info.extent, BoxFromProto("extent", message.extent()));
  }
  info.generation = message.generation();
  if (message.has_geo_origin()) {
    const v1::GeoOrigin& origin = message.geo_origin();
    info.geo_origin = GeoOrigin{origin.latitude_deg(),
                                origin.longitude_deg(),
                                origin.altitude_m(),
                                origin.heading_deg(),
                                {origin.anchor_x_m(), origin.anchor_y_m(), origin.anchor_z_m()}};
    if (status = Validate(*info.geo_origin); !status.ok()) return status;
  }
  return info;
}

v1::MapInfo ToProto(const MapInfo& info) {
  v1::MapInfo message;
  message.set_name(info.name);
  message.set_content_id(info.content_id);
  *message.mutable_params() = ToProto(info.params);
  message.mutable_sessions()->Add(info.sessions.begin(), info.sessions.end());
  message.set_num_places(info.num_places);
  if (info.extent) *message.mutable_extent() = BoxToProto(*info.extent);
  message.set_generation(info.generation);
  if (info.geo_origin) {
    v1::GeoOrigin& origin = *message.mutable_geo_origin();
    origin.set_latitude_deg(info.geo_origin->latitude_deg);
    origin.set_longitude_deg(info.geo_origin->longitude_deg);
    origin.set_altitude_m(info.geo_origin->altitude_m);
    origin.set_heading_deg(info.geo_origin->heading_deg);
    origin.set_anchor_x_m(info.geo_origin->anchor_m.x());
    origin.set_anchor_y_m(info.geo_origin->anchor_m.y());
    origin.set_anchor_z_m(info.geo_origin->anchor_m.z());
  }
  return message;
}

absl::StatusOr<std::vector<MapSummary>> FromProto(const v1::ListMapsResponse& message) {
  std::vector<MapSummary> maps;
  maps.reserve(message.maps_size());
  for (const v1::MapSummary& map : message.maps()) {
    absl::Status status = CheckAskedMap(map.name());
    status.Update(CheckLength("content_id", map.content_id(), kMaxContentIdBytes));
    status.Update(CheckNumPlaces(map.num_places()));
    status.Update(CheckEnum("maps.state", map.state(), v1::MapState_MAX));
    if (!status.ok()) return status;
    maps.push_back({.name = map.name(),
                    .state = static_cast<MapState>(map.state()),
                    .content_id = map.content_id(),
                    .num_places = map.num_places(),
                    .generation = map.generation()});
  }
  return maps;
}

absl::StatusOr<PlacesPage> FromProto(const v1::ListPlacesResponse& message) {
  absl::Status status = CheckLength("content_id", message.content_id(), kMaxContentIdBytes);
  status.Update(CheckLength("next_page_token", message.next_page_token(), 2 * kMaxContentIdBytes));
  status.Update(CheckRange("the number of places", message.places_size(), 0, kMaxPlacesPerPage));
  status.Update(CheckNumPlaces(message.first_place()));
  if (!status.ok()) return status;
  PlacesPage page{.content_id = message.content_id(),
                  .first_place = message.first_place(),
                  .places = {},
                  .next_page_token = message.next_page_token()};
  page.places.reserve(message.places_size());
  for (const v1::Place& place : message.places()) {
    ASSIGN_OR_RETURN(const auto converted, PlaceFromProto(place));
    page.places.push_back(converted);
    if (!place.has_geo()) continue;
    ASSIGN_OR_RETURN(const auto geo, GeoPoseFromProto("place.geo", place.geo()));
    page.geo.push_back(geo);
  }
  if (!page.geo.empty() && page.geo.size() != page.places.size()) {
    return absl::InvalidArgumentError("some places have a position on earth and others none");
  }
  return page;
}

v1::ListPlacesResponse ToProto(const PlacesPage& page) {
  v1::ListPlacesResponse message;
  message.set_content_id(page.content_id);
  message.set_first_place(page.first_place);
  for (std::size_t i = 0; i < page.places.size(); ++i) {
    *message.add_places() = PlaceToProto(page.places[i], page.geo.empty() ? nullptr : &page.geo[i]);
  }
  message.set_next_page_token(page.next_page_token);
  return message;
}

v1::ListMapsResponse ToProto(const std::vector<MapSummary>& maps) {
  v1::ListMapsResponse message;
  for (const MapSummary& map : maps) {
    v1::MapSummary& line = *message.add_maps();
    line.set_name(map.name);
    line.set_state(static_cast<v1::MapState>(map.state));
    line.set_content_id(map.content_id);
    line.set_num_places(map.num_places);
    line.set_generation(map.generation);
  }
  return message;
}

}  // namespace scanloc::proto
