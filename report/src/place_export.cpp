#include "scanloc/report/place_export.hpp"

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "scanloc/report/csv.hpp"
#include "scanloc/report/json.hpp"
#include "scanloc/report/trajectory_text.hpp"
#include "svg.hpp"

namespace scanloc::report {
namespace {

using Places = std::span<const ExportedPlace>;

/// To a tenth of a millimetre.
std::string Degrees(double degrees) { return FixedText(degrees, 9); }

std::string GridText(const geo::GeoPosition& position, const std::string& grid) {
  return grid == "utm" ? geo::UtmText(position) : geo::MgrsText(position);
}

std::string AsCsv(Places places, const std::string& grid) {
  const bool has_positions = !places.empty() && places.front().position.has_value();
  std::string text = absl::StrCat("place,session,scan,stamp_ns,x,y,z,qx,qy,qz,qw,num_voxels",
                                  has_positions ? ",latitude,longitude,altitude" : "",
                                  grid.empty() ? "" : ",grid", "\n");
  for (const ExportedPlace& place : places) {
    std::vector<std::string> fields = {absl::StrCat(place.index), place.session, place.scan,
                                       absl::StrCat(place.stamp_ns)};
    AppendPoseFields(place.T_map_place, &fields);
    fields.push_back(absl::StrCat(place.num_voxels));
    if (has_positions) {
      fields.insert(fields.end(),
                    {Degrees(place.position->latitude_deg), Degrees(place.position->longitude_deg),
                     FixedText(place.position->altitude_m, 4)});
    }
    if (!grid.empty()) fields.push_back(GridText(*place.position, grid));
    text += CsvRow(fields);
  }
  return text;
}

std::string AsTum(Places places) {
  std::string text;
  for (const ExportedPlace& place : places) text += TumRow(place.stamp_ns, place.T_map_place);
  return text;
}

std::string AsGeoJson(Places places, const std::string& grid) {
  Json json = {{"type", "FeatureCollection"}};
  Json& features = json["features"] = Json::array();
  for (const ExportedPlace& place : places) {
    Json properties = {{"place", place.index},
                       {"session", place.session},
                       {"scan", place.scan},
                       {"stamp_ns", place.stamp_ns}};
    if (!grid.empty()) properties["grid"] = GridText(*place.position, grid);
    features.push_back({{"type", "Feature"},
                        {"geometry",
                         {{"type", "Point"},
                          {"coordinates",
                           {place.position->longitude_deg, place.position->latitude_deg,
                            place.position->altitude_m}}}},
                        {"properties", std::move(properties)}});
  }
  return ToText(json);
}

/// Calls begin(session), point(place) and end() for runs of places of one session.
template <typename Begin, typename Point, typename End>
void ForEachTrack(Places places, Begin begin, Point point, End end) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (i == 0 || places[i].session != places[i - 1].session) begin(places[i].session);
    point(places[i]);
    if (i + 1 == places.size() || places[i + 1].session != places[i].session) end();
  }
}

std::string AsKml(Places places) {
  std::string text =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document>\n";
  ForEachTrack(
      places,
      [&](const std::string& session) {
        // Altitudes of KML are above the sea, not above the ellipsoid: on the ground, then.
        absl::StrAppend(&text, "<Placemark><name>", XmlEscaped(session),
                        "</name><LineString><altitudeMode>clampToGround</altitudeMode>"
                        "<coordinates>\n");
      },
      [&](const ExportedPlace& place) {
        absl::StrAppend(&text, Degrees(place.position->longitude_deg), ",",
                        Degrees(place.position->latitude_deg), "\n");
      },
      [&] { text += "</coordinates></LineString></Placemark>\n"; });
  return text + "</Document></kml>\n";
}

std::string AsGpx(Places places) {
  std::string text =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<gpx version=\"1.1\" creator=\"scanloc\" xmlns=\"http://www.topografix.com/GPX/1/1\">\n";
  ForEachTrack(
      places,
      [&](const std::string& session) {
        absl::StrAppend(&text, "<trk><name>", XmlEscaped(session), "</name><trkseg>\n");
      },
      [&](const ExportedPlace& place) {
        absl::StrAppend(&text, "<trkpt lat=\"", Degrees(place.position->latitude_deg), "\" lon=\"",
                        Degrees(place.position->longitude_deg), "\"><ele>",
                        FixedText(place.position->altitude_m, 3), "</ele>");
        if (place.stamp_ns != 0) {
          const absl::Time time = absl::FromUnixNanos(place.stamp_ns);
          absl::StrAppend(&text, "<time>",
                          absl::FormatTime("%Y-%m-%dT%H:%M:%E3SZ", time, absl::UTCTimeZone()),
                          "</time>");
        }
        text += "</trkpt>\n";
      },
      [&] { text += "</trkseg></trk>\n"; });
  return text + "</gpx>\n";
}

}  // namespace

absl::StatusOr<std::string> ExportPlaces(std::span<const ExportedPlace> places,
                                         const std::string& format, const std::string& grid) {
  if (!grid.empty() && grid != "utm" && grid != "mgrs") {
    return absl::InvalidArgumentError(absl::StrCat("no grid is named ", grid, "; utm, mgrs"));
  }
  const bool is_of_earth = format == "geojson" || format == "kml" || format == "gpx";
  if ((is_of_earth || !grid.empty()) && !places.empty() && !places.front().position) {
    return absl::FailedPreconditionError(
        absl::StrCat(grid.empty() ? format : grid,
                     " needs to know where on earth the map stands; tell it by scanloc edit IN OUT "
                     "--geo-origin LAT,LON,ALT or --geo-fixes FILE"));
  }
  if (format == "csv") return AsCsv(places, grid);
  if (format == "tum") return AsTum(places);
  if (format == "geojson") return AsGeoJson(places, grid);
  if (format == "kml") return AsKml(places);
  if (format == "gpx") return AsGpx(places);
  return absl::InvalidArgumentError(
      absl::StrCat("no format is named ", format, "; csv, tum, geojson, kml, gpx"));
}

}  // namespace scanloc::report
