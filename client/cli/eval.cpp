#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "cli/drive_options.hpp"
#include "cli/eval_report.hpp"
#include "cli/evaluation.hpp"
#include "cli/output.hpp"
#include "cli/progress.hpp"
#include "scanloc/dataset/drive.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {
namespace {

class EvalCommand : public Command {
 public:
  [[nodiscard]] std::string name() const override { return "eval"; }
  [[nodiscard]] std::string summary() const override {
    return "Measure how well methods recognise the places of a map";
  }
  void Declare(CLI::App& app) override;
  [[nodiscard]] absl::Status CheckUsage() const override { return selection_.CheckUsage(); }
  [[nodiscard]] absl::Status Run() override;

 private:
  [[nodiscard]] absl::StatusOr<std::vector<EvalQuery>> CollectQueries() const;
  [[nodiscard]] absl::StatusOr<std::vector<EvalMethod>> ChooseMethods(const Params& params) const;
  [[nodiscard]] absl::Status WriteReport(const EvalReport& report) const;

  std::string map_;
  std::string scans_dir_;
  PoseOptions truth_;
  ScanSelection selection_;
  std::vector<std::string> negatives_;
  std::vector<std::string> methods_;
  double within_m_ = 8.0;
  std::string report_dir_;
  bool json_ = false;
  int num_threads_ = 0;
  bool quiet_ = false;
};

void EvalCommand::Declare(CLI::App& app) {
  app.add_option("MAP", map_, "Map file")->required();
  app.add_option("--scans", scans_dir_, "Folder of scans to look up, or one with velodyne in it")
      ->required()
      ->type_name("DIR");
  truth_.Declare(app, "--poses", "Their true poses in the map frame")->required();
  app.add_option("--negatives", negatives_,
                 "Folder of scans that were taken elsewhere: whatever they are taken for is wrong; "
                 "may be given several times")
      ->type_name("DIR");
  app.add_option("--method", methods_,
                 "Methods, with commas between; NAME:K takes K candidates [all that the map "
                 "serves: auto,a-pc,a-cc,pc,cc]")
      ->delimiter(',')
      ->check([](const std::string& text) {
        return absl::StrCat(ParseEvalMethod(text).status().message());
      });
  app.add_option("--within-m", within_m_,
                 "A place this near to the query makes it a revisit, and a match right [m]")
      ->check(InRange(0.1, 1000.0))
      ->capture_default_str();
  app.add_option("--report", report_dir_,
                 "Folder to write report.html, results.json and matches.csv to; made if need be")
      ->type_name("DIR");
  app.add_flag("--json", json_, "One JSON document on standard output");
  AddThreadsOption(app, &num_threads_, "look up scans");
  AddQuietOption(app, &quiet_);
  selection_.Declare(app);
  app.footer(
      "Recall counts all revisits; a wrong match counts against precision whether its query is a\n"
      "revisit or not. Matches are accepted by confidence where a method tells one, else by\n"
      "distance.\n"
      "Examples:\n"
      "  scanloc eval town.scanloc --scans drive2 --poses drive2/poses.txt --report report\n"
      "  scanloc eval nclt.scanloc --scans nclt --poses nclt/poses.txt --from 468 --negatives "
      "kitti\n"
      "  scanloc eval town.scanloc --scans drive2 --poses drive2/poses.txt --method a-pc,a-pc:10");
}

absl::StatusOr<std::vector<EvalQuery>> EvalCommand::CollectQueries() const {
  const absl::StatusOr<dataset::Drive> drive = truth_.OpenDrive(scans_dir_);
  if (!drive.ok()) return drive.status();
  const absl::StatusOr<std::vector<dataset::Frame>> frames = Select(selection_, drive->frames);
  if (!frames.ok()) return frames.status();
  std::vector<EvalQuery> queries;
  for (const dataset::Frame& frame : *frames) {
    queries.push_back({.name = frame.name, .path = frame.path, .T_map_true = frame.T_map_sensor});
  }
  for (const std::string& folder : negatives_) {
    const absl::StatusOr<std::vector<dataset::ScanFile>> scans = dataset::ListScans(folder);
    if (!scans.ok()) return scans.status();
    for (const dataset::ScanFile& scan : *scans) {
      queries.push_back({.name = absl::StrCat(folder, "/", scan.name), .path = scan.path});
    }
  }
  return queries;
}

absl::StatusOr<std::vector<EvalMethod>> EvalCommand::ChooseMethods(const Params& params) const {
  std::vector<EvalMethod> chosen;
  const std::vector<std::string> all = {"auto", "a-pc", "a-cc", "pc", "cc"};
  for (const std::string& name : methods_.empty() ? all : methods_) {
    absl::StatusOr<EvalMethod> method = ParseEvalMethod(name);
    if (!method.ok()) return method.status();
    const absl::Status served = CheckServes(params, method->method);
    if (served.ok()) {
      chosen.push_back(*std::move(method));
    } else if (!methods_.empty()) {
      return served;
    }
  }
  return chosen;
}

absl::Status EvalCommand::WriteReport(const EvalReport& report) const {
  std::error_code error;
  std::filesystem::create_directories(report_dir_, error);
  if (error) {
    return absl::PermissionDeniedError(
        absl::StrCat("cannot make folder '", report_dir_, "': ", error.message()));
  }
  const std::filesystem::path folder = report_dir_;
  for (const auto& [name, text] :
       {std::pair("report.html", EvalAsHtml(report)), std::pair("results.json", EvalAsJson(report)),
        std::pair("matches.csv", EvalAsCsv(report))}) {
    if (absl::Status status = WriteText(folder / name, text); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status EvalCommand::Run() {
  absl::StatusOr<std::vector<EvalQuery>> queries = CollectQueries();
  if (!queries.ok()) return queries.status();
  absl::StatusOr<Map> loaded = mapdb::LoadMap(map_);
  if (!loaded.ok()) return loaded.status();
  EvalOptions options{.within_m = within_m_, .num_threads = num_threads_};
  absl::StatusOr<std::vector<EvalMethod>> methods = ChooseMethods(loaded->params);
  if (!methods.ok()) return methods.status();
  options.methods = *std::move(methods);
  const absl::StatusOr<std::shared_ptr<const Localizer>> localizer =
      Localizer::Create(std::make_shared<const Map>(*std::move(loaded)));
  if (!localizer.ok()) return localizer.status();
  const Map& map = (*localizer)->map();
  FindRevisits(map, within_m_, &*queries);

  absl::StatusOr<std::vector<MethodResult>> results = std::vector<MethodResult>();
  {
    Progress progress("scans looked up", quiet_);
    const std::size_t num_queries = queries->size();
    results = Evaluate(**localizer, *queries, options,
                       [&](std::size_t num_done) { progress.Update(num_done, num_queries); });
  }
  if (!results.ok()) return results.status();
  EvalReport report{.map = map_,
                    .content_id = map.content_id,
                    .within_m = within_m_,
                    .queries = *std::move(queries),
                    .results = *std::move(results)};
  for (const Place& place : map.places) {
    report.places.push_back(
        {place.T_map_place.translation().head<2>(), static_cast<std::size_t>(place.session)});
  }
  if (!report_dir_.empty()) {
    if (absl::Status status = WriteReport(report); !status.ok()) return status;
  }
  return WriteText("-", json_ ? EvalAsJson(report) : EvalAsTable(report));
}

}  // namespace

std::unique_ptr<Command> MakeEvalCommand() { return std::make_unique<EvalCommand>(); }

}  // namespace scanloc::cli
