#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cli/command.hpp"
#include "cli/drive_options.hpp"
#include "cli/output.hpp"
#include "scanloc/core/answer.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/report/answers_csv.hpp"
#include "scanloc/report/map_picture.hpp"

namespace scanloc::cli {
namespace {

class PlotCommand : public Command {
 public:
  PlotCommand() : Command("plot", "Draw a map, and the answers of locate, as an SVG picture") {}
  void Declare(CLI::App& app) override {
    app.add_option("MAP", map_, "Map file to draw, which gave the answers")->required();
    auto* answers = app.add_option("--answers", answers_, "CSV of scanloc locate [the map alone]")
                        ->type_name("CSV");
    app.add_option("--out", out_, "Picture to write, replaced if it is there; - is standard output")
        ->required()
        ->type_name("FILE.svg");
    CLI::Option* poses = truth_.Declare(app, "--truth",
                                        "True poses of the queries, if locate was not told them: a "
                                        "row a query, or with --scans a row "
                                        "a scan of the folder");
    poses->needs(answers);
    app.add_option("--scans", scans_dir_,
                   "Folder of the scans, if the queries were only some of them")
        ->type_name("DIR")
        ->needs(poses);
    app.add_option(
           "--within-m", within_m_,
           "A place this near to the query is right, where the CSV does not say what is missed [m]")
        ->check(InRange(0.0, 1e6));
    app.add_option("--title", title_, "Title [the map's name and the counts]");
    app.footer(
        "Blue: right, as locate --truth counts. Vermilion: wrong, with a line to the true "
        "position. "
        "Orange: ambiguous.\nGrey: not recognised, or a scan of too little.\n"
        "Examples:\n"
        "  scanloc plot town.scanloc --out town.svg\n"
        "  scanloc locate town.scanloc --scans drive2 --truth drive2/poses.txt --csv answers.csv\n"
        "  scanloc plot town.scanloc --answers answers.csv --out answers.svg");
  }
  [[nodiscard]] absl::Status Run() override {
    ASSIGN_OR_RETURN(const std::vector<mapdb::PlaceRecord> records, mapdb::ReadPlaces(map_));
    std::vector<report::PicturedPlace> places;
    for (const mapdb::PlaceRecord& record : records) {
      places.push_back({record.place.T_map_place.translation().head<2>(),
                        static_cast<std::size_t>(record.place.session)});
    }
    if (answers_.empty()) return WriteText(out_, report::DrawMapPicture(Title({}), places, {}));
    ASSIGN_OR_RETURN(std::vector<report::CsvAnswer> answers, report::ReadAnswersCsv(answers_));
    RETURN_IF_ERROR(AddTruth(&answers));
    ASSIGN_OR_RETURN(const std::vector<report::PicturedQuery> queries, Judge(answers, places));
    return WriteText(out_, report::DrawMapPicture(Title(queries), places, queries));
  }

 private:
  [[nodiscard]] absl::Status AddTruth(std::vector<report::CsvAnswer>* answers) const {
    const bool all_told = std::ranges::all_of(
        *answers, [](const report::CsvAnswer& a) { return a.truth.has_value(); });
    if (truth_.poses_file().empty() || all_told) return absl::OkStatus();
    if (!scans_dir_.empty()) {
      ASSIGN_OR_RETURN(const dataset::Drive drive, truth_.OpenDrive(scans_dir_));
      std::map<std::string, Eigen::Vector2d> by_name;
      for (const dataset::Frame& frame : drive.frames) {
        by_name[frame.name] = frame.T_map_sensor.translation().head<2>();
      }
      for (report::CsvAnswer& answer : *answers) {
        const auto found = by_name.find(answer.query);
        if (found != by_name.end()) answer.truth = found->second;
      }
      return absl::OkStatus();
    }
    ASSIGN_OR_RETURN(const dataset::Trajectory trajectory, truth_.ReadTrajectory());
    if (trajectory.T_map_sensor.size() != answers->size()) {
      return absl::InvalidArgumentError(absl::StrCat(
          truth_.poses_file(), " has ", trajectory.T_map_sensor.size(), " poses, but ", answers_,
          " has ", answers->size(),
          " queries; name the folder of the scans with --scans, so that they are paired by name"));
    }
    for (std::size_t i = 0; i < answers->size(); ++i) {
      (*answers)[i].truth = trajectory.T_map_sensor[i].translation().head<2>();
    }
    return absl::OkStatus();
  }
  [[nodiscard]] absl::StatusOr<std::vector<report::PicturedQuery>> Judge(
      const std::vector<report::CsvAnswer>& answers,
      const std::vector<report::PicturedPlace>& places) const {
    std::vector<report::PicturedQuery> queries;
    for (const report::CsvAnswer& answer : answers) {
      report::PicturedQuery query{
          .query = answer.query, .answered = answer.answered, .truth = answer.truth};
      if (answer.place.has_value() && *answer.place >= places.size()) {
        return absl::InvalidArgumentError(absl::StrCat(
            answers_, ": ", answer.query, " was answered with place ", *answer.place, ", but ",
            map_, " has ", places.size(), " places; these answers are from another map"));
      }
      if (answer.outcome == OutcomeName(Outcome::kAmbiguous)) {
        query.verdict = report::Verdict::kAmbiguous;
      } else if (answer.outcome != OutcomeName(Outcome::kLocalized) || !answer.place.has_value()) {
        query.verdict = report::Verdict::kNotRecognized;
      } else if (!answer.truth.has_value()) {
        query.verdict = report::Verdict::kUnchecked;
      } else if (answer.is_right.has_value()) {
        query.verdict = *answer.is_right ? report::Verdict::kRight : report::Verdict::kWrong;
      } else {
        const double error_m = (places[*answer.place].position - *answer.truth).norm();
        query.verdict = error_m <= within_m_ ? report::Verdict::kRight : report::Verdict::kWrong;
      }
      queries.push_back(std::move(query));
    }
    return queries;
  }
  [[nodiscard]] std::string Title(const std::vector<report::PicturedQuery>& queries) const {
    if (!title_.empty()) return title_;
    if (answers_.empty()) return std::filesystem::path(map_).filename().string();
    return absl::StrFormat("%s: answers to %d queries",
                           std::filesystem::path(map_).filename().string(), queries.size());
  }

  std::string map_;
  std::string answers_;
  std::string scans_dir_;
  PoseOptions truth_;
  double within_m_ = 8.0;
  std::string title_;
  std::string out_;
};

}  // namespace

std::unique_ptr<Command> MakePlotCommand() { return std::make_unique<PlotCommand>(); }

}  // namespace scanloc::cli
