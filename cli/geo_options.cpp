#include "cli/geo_options.hpp"

#include <CLI/CLI.hpp>

#include "absl/strings/str_format.h"
#include "cli/command.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/geo/fit_origin.hpp"
#include "scanloc/mapdb/geo_origin.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {
namespace {

absl::StatusOr<GeoOrigin> ParseOrigin(const std::string& text) {
  absl::StatusOr<std::vector<double>> n = ParseNumbers(text, 4, "LAT,LON,ALT,HEADING");
  if (!n.ok()) n = ParseNumbers(text, 3, "LAT,LON,ALT");
  if (!n.ok()) return n.status();
  GeoOrigin origin{(*n)[0], (*n)[1], (*n)[2]};
  if (n->size() == 4) origin.heading_deg = (*n)[3];
  RETURN_IF_ERROR(Validate(origin));
  return origin;
}

absl::StatusOr<geo::FittedOrigin> Fit(const std::string& map,
                                      const std::vector<dataset::GnssFix>& fixes) {
  ASSIGN_OR_RETURN(const std::vector<mapdb::PlaceRecord> records, mapdb::ReadPlaces(map));
  std::vector<geo::Fix> pairs;
  for (const mapdb::PlaceRecord& record : records) {
    const auto fix = dataset::FixAt(fixes, record.place.stamp_ns);
    if (!fix) continue;
    pairs.push_back({record.place.T_map_place.translation(),
                     {fix->latitude_deg, fix->longitude_deg, fix->altitude_m}});
  }
  return geo::FitOrigin(pairs);
}

}  // namespace

void GeoOptions::Declare(CLI::App& app) {
  AddParsedOption(
      app, "--geo-origin",
      [this](const std::string& text) {
        const absl::StatusOr<GeoOrigin> origin = ParseOrigin(text);
        if (origin.ok()) origin_ = *origin;
        return origin.status();
      },
      "Where on earth the zero of the map frame is, z up (WGS 84; altitude above the ellipsoid "
      "[m]; "
      "heading of x, clockwise from north [deg], 90 if not given: x east, y north)")
      ->type_name("LAT,LON,ALT[,HEADING]");
  app.add_option(
         "--geo-fixes", fixes_path_,
         "The same from fixes of a GNSS receiver at the times of the scans: a CSV file with "
         "the columns stamp, latitude, longitude, altitude, or a bag with "
         "sensor_msgs/NavSatFix")
      ->type_name("FILE");
}

absl::Status GeoOptions::CheckUsage() const {
  if (!origin_ || fixes_path_.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError("--geo-origin or --geo-fixes, not both");
}

absl::Status GeoOptions::Read() {
  if (fixes_path_.empty()) return absl::OkStatus();
  absl::StatusOr<std::vector<dataset::GnssFix>> fixes = dataset::ReadGnssFixes(fixes_path_);
  if (fixes.ok()) fixes_ = *std::move(fixes);
  return fixes.status();
}

absl::StatusOr<std::string> GeoOptions::Apply(const std::string& map) const {
  if (origin_) {
    RETURN_IF_ERROR(mapdb::SetGeoOrigin(map, *origin_));
    return absl::StrFormat("  on earth    %s\n", GeoOriginAsText(*origin_));
  }
  if (fixes_path_.empty()) return std::string();
  ASSIGN_OR_RETURN(const geo::FittedOrigin fitted, Fit(map, fixes_));
  RETURN_IF_ERROR(mapdb::SetGeoOrigin(map, fitted.origin));
  return absl::StrFormat(
      "  on earth    %s\n"
      "              by %d fixes, %.2f m off in the plane (rms), %.2f m at most\n",
      GeoOriginAsText(fitted.origin), fitted.num_used, fitted.rms_m, fitted.max_m);
}

std::string GeoOriginAsText(const GeoOrigin& origin) {
  std::string text = absl::StrFormat("%.9f %.9f, %.2f m above the ellipsoid, x %.3f deg from north",
                                     origin.latitude_deg, origin.longitude_deg, origin.altitude_m,
                                     origin.heading_deg);
  if (!origin.anchor_m.isZero(0.0)) {
    absl::StrAppendFormat(&text, ", at %.2f %.2f %.2f of the map", origin.anchor_m.x(),
                          origin.anchor_m.y(), origin.anchor_m.z());
  }
  return text;
}

}  // namespace scanloc::cli
