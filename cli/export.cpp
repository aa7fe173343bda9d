#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "cli/command.hpp"
#include "cli/output.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/report/csv.hpp"
#include "scanloc/report/trajectory_text.hpp"

namespace scanloc::cli {
namespace {

std::string PlaceAsCsv(std::size_t index, const mapdb::PlaceRecord& record,
                       const std::vector<mapdb::SessionInfo>& sessions) {
  std::vector<std::string> fields = {std::to_string(index),
                                     sessions[static_cast<std::size_t>(record.place.session)].name,
                                     record.scan, std::to_string(record.place.stamp_ns)};
  report::AppendPoseFields(record.place.T_map_place, &fields);
  fields.push_back(std::to_string(record.num_voxels));
  return report::CsvRow(fields);
}

class ExportCommand : public Command {
 public:
  [[nodiscard]] std::string name() const override { return "export"; }
  [[nodiscard]] std::string summary() const override {
    return "Write the places of a map as CSV or as a TUM trajectory";
  }
  void Declare(CLI::App& app) override {
    app.add_option("MAP", map_, "Map file")->required();
    app.add_option("--format", format_,
                   "csv: a row a place with its session, scan and pose; tum: stamp [s] x y z qx qy "
                   "qz qw")
        ->check(CLI::IsMember({"csv", "tum"}))
        ->capture_default_str();
    app.add_option("--out", out_, "File to write, replaced if it is there; - is standard output")
        ->capture_default_str();
    app.footer(
        "Places of a drive without times have the stamp 0.\n"
        "Examples:\n"
        "  scanloc export town.scanloc --out places.csv\n"
        "  scanloc export town.scanloc --format tum --out places.tum");
  }
  [[nodiscard]] absl::Status Run() override {
    const absl::StatusOr<mapdb::MapInfo> info = mapdb::ReadInfo(map_);
    if (!info.ok()) return info.status();
    const absl::StatusOr<std::vector<mapdb::PlaceRecord>> places = mapdb::ReadPlaces(map_);
    if (!places.ok()) return places.status();
    absl::StatusOr<TextOutput> output = TextOutput::Open(out_);
    if (!output.ok()) return output.status();
    if (format_ == "csv") {
      output->Append("place,session,scan,stamp_ns,x,y,z,qx,qy,qz,qw,num_voxels\n");
    }
    for (std::size_t i = 0; i < places->size(); ++i) {
      const mapdb::PlaceRecord& record = (*places)[i];
      output->Append(format_ == "csv"
                         ? PlaceAsCsv(i, record, info->sessions)
                         : report::TumRow(record.place.stamp_ns, record.place.T_map_place));
    }
    return output->Close();
  }

 private:
  std::string map_;
  std::string format_ = "csv";
  std::string out_ = "-";
};

}  // namespace

std::unique_ptr<Command> MakeExportCommand() { return std::make_unique<ExportCommand>(); }

}  // namespace scanloc::cli
