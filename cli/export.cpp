#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/command.hpp"
#include "cli/output.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/geo/geo_frame.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/report/place_export.hpp"

namespace scanloc::cli {
namespace {

class ExportCommand : public Command {
 public:
  ExportCommand()
      : Command("export", "Write the places of a map as CSV, TUM, GeoJSON, KML or GPX") {}
  void Declare(CLI::App& app) override {
    app.add_option("MAP", map_, "Map file")->required();
    app.add_option("--format", format_,
                   "csv: a row a place with its session, scan and pose; tum: stamp [s] x y z qx qy "
                   "qz qw; of a map that knows where on earth it stands, geojson: a point a place, "
                   "kml and gpx: a track a session")
        ->check(CLI::IsMember({"csv", "tum", "geojson", "kml", "gpx"}));
    app.add_option("--grid", grid_, "With csv and geojson: coordinates of a grid, too")
        ->check(CLI::IsMember({"utm", "mgrs"}));
    app.add_option("--out", out_, "File to write, replaced if it is there; - is standard output");
    app.footer(
        "Places of a drive without times have the stamp 0.\n"
        "Examples:\n"
        "  scanloc export town.scanloc --out places.csv\n"
        "  scanloc export town.scanloc --format tum --out places.tum\n"
        "  scanloc export town.scanloc --format kml --out places.kml");
  }
  [[nodiscard]] absl::Status Run() override {
    ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(map_));
    ASSIGN_OR_RETURN(const std::vector<mapdb::PlaceRecord> records, mapdb::ReadPlaces(map_));
    std::optional<geo::GeoFrame> frame;
    if (info.geo_origin) {
      ASSIGN_OR_RETURN(frame, geo::GeoFrame::Create(*info.geo_origin));
    }
    std::vector<report::ExportedPlace> places;
    for (const mapdb::PlaceRecord& record : records) {
      const Place& place = record.place;
      places.push_back({.index = places.size(),
                        .session = info.sessions[static_cast<std::size_t>(place.session)].name,
                        .scan = record.scan,
                        .stamp_ns = place.stamp_ns,
                        .num_voxels = record.num_voxels,
                        .T_map_place = place.T_map_place});
      if (frame) places.back().position = frame->ToGeo(place.T_map_place.translation());
    }
    ASSIGN_OR_RETURN(const std::string text, report::ExportPlaces(places, format_, grid_));
    return WriteText(out_, text);
  }

 private:
  std::string map_;
  std::string format_ = "csv";
  std::string grid_;
  std::string out_ = "-";
};

}  // namespace

std::unique_ptr<Command> MakeExportCommand() { return std::make_unique<ExportCommand>(); }

}  // namespace scanloc::cli
