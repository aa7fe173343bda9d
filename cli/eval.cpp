#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "cli/descriptor_options.hpp"
#include "cli/drive_options.hpp"
#include "cli/drive_plan.hpp"
#include "cli/intensity_options.hpp"
#include "cli/output.hpp"
#include "cli/progress.hpp"
#include "cli/provenance.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/dataset/drive.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "scanloc/eval/baseline.hpp"
#include "scanloc/eval/evaluation.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/report/eval_paper.hpp"
#include "scanloc/report/eval_report.hpp"

namespace scanloc::cli {
namespace {

/// A scan this near to a place was taken there: poses are rounded in files.
constexpr double kSamePlace_m = 0.01;

/// With one query in so many at a place, the map was surely made of their drive.
constexpr std::size_t kOwnDriveShare = 10;

/// Says so on stderr if the queries are scans that the map was made of, and each may find itself.
void WarnOfOwnDrive(const std::vector<eval::EvalQuery>& queries) {
  const auto count = [&](auto&& is_counted) {
    return static_cast<std::size_t>(std::ranges::count_if(queries, is_counted));
  };
  const std::size_t num_at_place = count([](const eval::EvalQuery& query) {
    return query.has_place && query.variance.translation_m <= kSamePlace_m;
  });
  const std::size_t num_with_place =
      count([](const eval::EvalQuery& query) { return query.has_place; });
  if (num_at_place < 2 || num_at_place * kOwnDriveShare < num_with_place) return;
  std::fprintf(stderr,
               "scanloc eval: warning: %zu of %zu queries were taken at 0.00 m from a place; if "
               "the map was made of this drive, they find themselves: give --in-session\n",
               num_at_place, num_with_place);
}

/// OK if the map can be taken for one that grew as the queries were taken, else why not.
absl::Status CheckSession(const Map& map, const std::vector<eval::EvalQuery>& queries) {
  if (map.sessions.size() > 1) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--in-session needs a map of one session; this one has ", map.sessions.size()));
  }
  // Drives may count their time from 0, which alone stands for none.
  const bool has_places =
      std::ranges::any_of(map.places, [](const Place& place) { return place.stamp_ns != 0; });
  const bool has_queries = std::ranges::any_of(
      queries, [](const eval::EvalQuery& query) { return query.stamp_ns != 0; });
  if (has_places && has_queries) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("--in-session needs to know when scans were taken, and those of the ",
                   has_places ? "queries have no times" : "map's places have none",
                   "; give --times at build and here, or poses with stamps"));
}

/// The files must stay.
eval::ReadScan ReaderOf(const std::vector<dataset::ScanFile>& files, const SensorMount& mount) {
  return [&files, mount](std::size_t number) -> absl::StatusOr<PointCloud> {
    ASSIGN_OR_RETURN(SeenScan seen, ReadSeenScan(files[number], mount));
    return std::move(seen.scan.points);
  };
}

class EvalCommand : public Command {
 public:
  EvalCommand() : Command("eval", "Measure how well methods recognise the places of a map") {}
  void Declare(CLI::App& app) override {
    app.add_option("MAP", map_, "Map file")->required();
    app.add_option("--scans", scans_dir_, "Folder of scans to look up, or one with velodyne in it")
        ->type_name("DIR");
    truth_.Declare(app, "--poses", "Their true poses in the map frame");
    truth_.DeclareBag(app);
    truth_.DeclareMount(app);
    app.add_option(
           "--negatives", negatives_,
           "Folder of scans that were taken elsewhere: whatever they are taken for is wrong; "
           "may be given several times")
        ->type_name("DIR");
    app.add_option(
           "--method", methods_,
           absl::StrCat("Methods, with commas between; NAME:K takes K candidates [all that "
                        "the map serves: auto,a-pc,a-cc,pc,cc]; baselines to compare with: ",
                        eval::BaselineNames(),
                        "; m2dp, segmatch and those with -mean, -count, -bits or -intensity "
                        "need --map-scans, those with -radar --radar"))
        ->delimiter(',')
        ->check(ParsedBy(&eval::ParseEvalMethod));
    app.add_option(
           "--within-m", within_m_,
           "A place this near to the query makes it a revisit, and a match right [m]; several "
           "with commas between are measured one by one")
        ->delimiter(',')
        ->check(InRange(0.1, 1000.0));
    app.add_option("--query-spacing-m", query_spacing_m_,
                   "Travel between the scans that are looked up; 0: all [m]")
        ->check(InRange(0.0, 1e6));
    auto* in_session =
        app.add_flag("--in-session", in_session_,
                     "The map was made of this very drive: each scan sees only the places that are "
                     "older than the window, as if the map grew");
    app.add_option("--window-s", window_s_, "That window [s]")
        ->check(InRange(0.0, 1e6))
        ->needs(in_session);
    app.add_option("--query-tilt-deg", tilt_deg_,
                   "Turn each scan by a roll and a pitch of up to this, drawn by its number [deg]")
        ->check(InRange(0.0, 90.0));
    app.add_option("--map-scans", map_scans_dir_,
                   "Folder of the scans that the map was made of; for baselines")
        ->type_name("DIR");
    map_poses_.DeclareFiles(app, "--map-poses", "--map-calib");
    descriptors_.Declare(app);
    intensities_.Declare(app);
    app.add_flag("--stage-times", times_, "Tell the time of each stage, too");
    app.add_option(
           "--report", report_dir_,
           "Folder to write report.html, results.json, matches.csv and figures to; made if need be")
        ->type_name("DIR");
    app.add_flag("--json", json_, "One JSON document on standard output");
    AddThreadsOption(app, &num_threads_, "look up scans");
    AddQuietOption(app, &quiet_);
    selection_.Declare(app);
    app.footer(
        "Recall counts all revisits; a match is right if its place lies near enough, and a wrong "
        "one\n"
        "counts against precision whether its query is a revisit or not. Matches are accepted by\n"
        "confidence where a method tells one, else by distance. Times are processor time of one\n"
        "thread that asks 50 of the queries once more, with --stage-times all of them.\n"
        "Examples:\n"
        "  scanloc eval town.scanloc --scans drive2 --poses drive2/poses.txt --report report\n"
        "  scanloc eval nclt.scanloc --scans nclt --poses nclt/poses.txt --from 468 --negatives "
        "kitti\n"
        "  scanloc eval town.scanloc --scans drive2 --poses drive2/poses.txt --method "
        "a-pc,a-pc:10\n"
        "  scanloc eval town.scanloc --scans drive2 --poses drive2/poses.txt --within-m 8,4,2,1\n"
        "  scanloc eval 00.scanloc --scans 00 --poses 00.txt --calib calib.txt --times times.txt "
        "--in-session");
  }
  [[nodiscard]] absl::Status CheckUsage() const override {
    RETURN_IF_ERROR(truth_.CheckUsageWithPoses(scans_dir_));
    if (map_scans_dir_.empty() != map_poses_.poses_file().empty()) {
      return absl::InvalidArgumentError("--map-scans and --map-poses go together");
    }
    RETURN_IF_ERROR(descriptors_.CheckUsage(truth_.has_bag(), in_session_, tilt_deg_));
    RETURN_IF_ERROR(intensities_.CheckUsage(methods_, in_session_, tilt_deg_));
    return selection_.CheckUsage();
  }
  [[nodiscard]] absl::Status Run() override {
    std::vector<dataset::ScanFile> files;
    ASSIGN_OR_RETURN(std::vector<eval::EvalQuery> queries, CollectQueries(&files));
    ASSIGN_OR_RETURN(Map loaded, mapdb::LoadMap(map_));
    eval::EvalOptions options{.methods = {},
                              .within_m = within_m_,
                              .tilt_deg = tilt_deg_,
                              .num_threads = num_threads_,
                              .time_places = times_,
                              .read_query = ReaderOf(files, truth_.mount())};
    if (in_session_) {
      RETURN_IF_ERROR(CheckSession(loaded, queries));
    }
    ASSIGN_OR_RETURN(std::vector<dataset::ScanFile> place_scans, FindPlaceScans(loaded));
    const SensorMount place_mount = map_scans_dir_.empty() ? truth_.mount() : SensorMount();
    if (!place_scans.empty()) options.read_place = ReaderOf(place_scans, place_mount);
    ASSIGN_OR_RETURN(options.methods, ChooseMethods(loaded.params));
    const DescriptorOptions::Scans scans{scans_dir_,     negatives_,  files,
                                         map_scans_dir_, place_scans, loaded.places.size()};
    RETURN_IF_ERROR(descriptors_.AddTo(scans, &options));
    const IntensityOptions::Scans seen{queries,     files,       truth_.mount(),
                                       place_scans, place_mount, loaded};
    RETURN_IF_ERROR(intensities_.AddTo(seen, quiet_, &options));
    ASSIGN_OR_RETURN(const std::shared_ptr<const Localizer> localizer,
                     Localizer::Create(std::make_shared<const Map>(std::move(loaded))));
    const Map& map = localizer->map();
    eval::FindRevisits(map, within_m_.front(), &queries);
    if (!in_session_) WarnOfOwnDrive(queries);
    if (times_) options.num_timed = queries.size();

    absl::StatusOr<std::vector<eval::MethodResult>> results = std::vector<eval::MethodResult>();
    {
      Progress progress("scans looked up", quiet_);
      const std::size_t num_queries = queries.size();
      results = eval::Evaluate(*localizer, queries, options, [&](std::size_t num_done) {
        progress.Update(num_done, num_queries);
      });
    }
    if (!results.ok()) return results.status();
    report::EvalReport report{.map = map_,
                              .content_id = map.content_id,
                              .mount = truth_.mount(),
                              .within_m = within_m_.front(),
                              .queries = std::move(queries),
                              .results = *std::move(results)};
    for (const Place& place : map.places) {
      report.places.push_back(
          {place.T_map_place.translation().head<2>(), static_cast<std::size_t>(place.session)});
    }
    if (!report_dir_.empty()) {
      report.made = MadeNow();
      std::vector<std::pair<std::string, std::string>> written = {
          {"results.json", report::EvalAsJson(report)},
          {"matches.csv", report::EvalAsCsv(report)},
          {"report.html", report::EvalAsHtml(report)}};
      for (report::ReportFile& file : report::PaperFiles(report)) {
        written.emplace_back(std::move(file.name), std::move(file.text));
      }
      report.made = {};
      RETURN_IF_ERROR(WriteReport(report_dir_, written));
      RETURN_IF_ERROR(MakePdfs(report_dir_, written));
    }
    return WriteText("-", json_ ? report::EvalAsJson(report) : report::EvalAsTable(report, times_));
  }

 private:
  /// The files go with the queries.
  [[nodiscard]] absl::StatusOr<std::vector<eval::EvalQuery>> CollectQueries(
      std::vector<dataset::ScanFile>* files) const {
    ASSIGN_OR_RETURN(const dataset::Drive drive, truth_.OpenDrive(scans_dir_));
    ASSIGN_OR_RETURN(std::vector<dataset::Frame> frames, Select(selection_, drive.frames));
    std::vector<eval::EvalQuery> queries;
    for (const dataset::Frame& frame : Thinned(std::move(frames), query_spacing_m_)) {
      eval::EvalQuery query{.name = frame.name,
                            .T_map_true = TurnedOfSensor(truth_.mount(), frame.T_map_sensor),
                            .stamp_ns = frame.stamp_ns};
      if (in_session_) {
        query.sees_until_ns = frame.stamp_ns - static_cast<std::int64_t>(window_s_ * 1e9);
      }
      queries.push_back(std::move(query));
      files->push_back(frame.file());
    }
    for (const std::string& folder : negatives_) {
      ASSIGN_OR_RETURN(const std::vector<dataset::ScanFile> scans, dataset::ListScans(folder));
      for (const dataset::ScanFile& scan : scans) {
        queries.push_back({.name = absl::StrCat(folder, "/", scan.name)});
        files->push_back(scan);
      }
    }
    return queries;
  }
  [[nodiscard]] absl::StatusOr<std::vector<eval::EvalMethod>> ChooseMethods(
      const Params& params) const {
    std::vector<eval::EvalMethod> chosen;
    const std::vector<std::string> all = {"auto", "a-pc", "a-cc", "pc", "cc"};
    for (const std::string& name : methods_.empty() ? all : methods_) {
      ASSIGN_OR_RETURN(eval::EvalMethod method, eval::ParseEvalMethod(name));
      const absl::Status served = CheckServes(params, method);
      if (served.ok()) {
        chosen.push_back(std::move(method));
      } else if (!methods_.empty()) {
        return served;
      }
    }
    return chosen;
  }
  /// The scan of each place; empty without --map-scans.
  [[nodiscard]] absl::StatusOr<std::vector<dataset::ScanFile>> FindPlaceScans(
      const Map& map) const {
    std::vector<dataset::ScanFile> scans;
    if (map_scans_dir_.empty() && !in_session_) return scans;
    ASSIGN_OR_RETURN(const dataset::Drive drive, map_scans_dir_.empty()
                                                     ? truth_.OpenDrive(scans_dir_)
                                                     : map_poses_.OpenDrive(map_scans_dir_));
    for (const Place& place : map.places) {
      const auto distance_m = [&](const dataset::Frame& frame) {
        return (frame.T_map_sensor.translation() - place.T_map_place.translation()).norm();
      };
      const auto nearest = std::ranges::min_element(
          drive.frames,
          [&](const auto& a, const auto& b) { return distance_m(a) < distance_m(b); });
      if (distance_m(*nearest) > kSamePlace_m) {
        return absl::InvalidArgumentError(absl::StrCat(
            "no scan was taken where the map has place ", scans.size(), "; the nearest is ",
            distance_m(*nearest), " m away. Is it the drive that the map was made of?"));
      }
      scans.push_back(nearest->file());
    }
    return scans;
  }

  std::string map_;
  std::string scans_dir_;
  PoseOptions truth_;
  ScanSelection selection_;
  std::vector<std::string> negatives_;
  std::vector<std::string> methods_;
  std::vector<double> within_m_ = {8.0};
  bool in_session_ = false;
  double window_s_ = 30.0;
  double query_spacing_m_ = 0.0;
  double tilt_deg_ = 0.0;
  std::string map_scans_dir_;
  PoseOptions map_poses_;
  DescriptorOptions descriptors_;
  IntensityOptions intensities_;
  bool times_ = false;
  std::string report_dir_;
  bool json_ = false;
  int num_threads_ = 0;
  bool quiet_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeEvalCommand() { return std::make_unique<EvalCommand>(); }

}  // namespace scanloc::cli
