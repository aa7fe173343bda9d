#include <CLI/CLI.hpp>
#include <string>

#include "cli/change_detection.hpp"
#include "cli/command.hpp"
#include "cli/output.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/report/change_report.hpp"

namespace scanloc::cli {
namespace {

class DiffCommand : public Command {
 public:
  DiffCommand()
      : Command("diff",
                "Say place by place what two maps, or a map and a new drive, see differently") {}
  void Declare(CLI::App& app) override {
    app.add_option("MAP", map_, "Map file")->required();
    app.add_option("OTHER", other_, "Another map file, in the same map frame");
    drive_.Declare(app);
    app.add_flag("--json", json_, "One JSON document with every place");
    app.add_option("--geojson", geojson_, "File for the places as GeoJSON, metres of the map frame")
        ->type_name("FILE");
    app.add_option("--picture", picture_, "Picture to write")->type_name("FILE.svg");
    app.footer(
        "Examples:\n"
        "  scanloc diff town.scanloc new.scanloc --picture changes.svg\n"
        "  scanloc diff town.scanloc --scans drive9 --poses drive9/poses.txt --json\n"
        "  scanloc diff town.scanloc --scans drive9 --poses drive9/odometry.txt --align");
  }
  [[nodiscard]] absl::Status CheckUsage() const override {
    if (other_.empty()) return drive_.CheckUsage();
    if (!drive_.given()) return absl::OkStatus();
    return absl::InvalidArgumentError("compare with another map or with a drive, not with both");
  }
  [[nodiscard]] absl::Status Run() override {
    ASSIGN_OR_RETURN(const DetectedChanges changes, other_.empty()
                                                        ? drive_.CompareWithDrive(map_)
                                                        : drive_.CompareWithMap(map_, other_));
    const report::ChangeReport report = changes.Report();
    if (!geojson_.empty()) {
      RETURN_IF_ERROR(WriteText(geojson_, report::ToText(report::ChangesAsGeoJson(report))));
    }
    if (!picture_.empty()) {
      RETURN_IF_ERROR(WriteText(picture_, report::DrawChanges(report)));
    }
    return WriteText(
        "-", json_ ? report::ToText(report::ChangesAsJson(report)) : report::ChangesAsText(report));
  }

 private:
  std::string map_;
  std::string other_;
  ComparedDrive drive_;
  std::string geojson_;
  std::string picture_;
  bool json_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeDiffCommand() { return std::make_unique<DiffCommand>(); }

}  // namespace scanloc::cli
