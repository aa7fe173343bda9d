#include "cli/slam_options.hpp"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <memory>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "cli/command.hpp"
#include "cli/drive_plan.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/report/trajectory_text.hpp"
#include "scanloc/slam/align_drive.hpp"

namespace scanloc::cli {
namespace {

/// kitti, tum or g2o.
std::string FormatOf(const std::string& asked, const std::string& path) {
  if (asked != "auto") return asked;
  const std::string extension = std::filesystem::path(path).extension().string();
  return extension == ".tum" || extension == ".g2o" ? extension.substr(1) : "kitti";
}

std::vector<report::ReportedLoop> LoopsOf(const mapdb::SessionPlan& plan,
                                          const slam::ClosedDrive& closed) {
  std::vector<report::ReportedLoop> loops;
  for (const slam::FoundConstraint& found : closed.constraints) {
    const slam::Constraint& constraint = found.constraint;
    loops.push_back(
        {.from = constraint.from ? plan.scans[*constraint.from].name : "",
         .to = plan.scans[constraint.to].name,
         .from_scan = constraint.from,
         .to_scan = constraint.to,
         .confidence = found.confidence,
         .is_on = found.is_on,
         .error_m = found.error.translation().norm(),
         .error_deg = Eigen::AngleAxisd(found.error.linear()).angle() * 180.0 / std::numbers::pi,
         .chi2 = found.chi2});
  }
  return loops;
}

/// The graph as g2o has it: odometry with the drift taken out, and what holds. Constraints to the
/// map are left out: its frame is no vertex.
std::vector<report::GraphEdge> EdgesOf(const mapdb::SessionPlan& plan,
                                       const slam::ClosedDrive& closed) {
  std::vector<report::GraphEdge> edges;
  for (std::size_t i = 1; i < plan.scans.size(); ++i) {
    report::GraphEdge edge{.from = i - 1, .to = i};
    edge.T_from_to = slam::WithoutDrift(
        plan.scans[i - 1].T_map_place.inverse() * plan.scans[i].T_map_place, closed.drift);
    edge.information = slam::InformationOfStep(edge.T_from_to, closed.noise);
    edges.push_back(std::move(edge));
  }
  for (const slam::FoundConstraint& found : closed.constraints) {
    if (!found.is_on || !found.constraint.from) continue;
    edges.push_back({*found.constraint.from, found.constraint.to, found.constraint.T_from_to,
                     found.constraint.information});
  }
  return edges;
}

}  // namespace

void SlamOptions::Declare(CLI::App& app) {
  app.add_option("--scans", scans_dir_, "Folder of the scans, as of build")->type_name("DIR");
  poses_.Declare(app, "--poses", "Odometry of the drive: a pose a scan, in a frame of its own");
  poses_.DeclareBag(app);
  poses_.DeclareMount(app);
  app.add_option("--out", out_,
                 "File for the poses, replaced if it is there; may be given several times")
      ->required()
      ->type_name("FILE");
  app.add_option("--out-format", out_format_,
                 "kitti, tum or g2o (the graph, too); auto: by the ends .tum and .g2o, else kitti")
      ->check(CLI::IsMember({"auto", "kitti", "tum", "g2o"}));
  truth_.DeclareFiles(app, "--truth", "--truth-calib");
  app.add_option("--report", report_dir_,
                 "Folder for report.html, results.json and loops.csv; made if need be")
      ->type_name("DIR");
  app.add_flag("--json", json_, "One JSON document on stdout");
  app.add_option("--method", method_,
                 "How scans are compared: auto, or the paper's pc, a-pc, a-cc [auto]")
      ->check(ParsedBy(&ParseMethod));
  app.add_option("--spacing-m", spacing_m_,
                 "Distance between scans that are looked up; all get a pose [m]")
      ->check(InRange(0.0, 1e6));
  app.add_option("--window-m", window_m_, "Least way between the two scans of a loop [m]")
      ->check(InRange(0.1, 1e6));
  AddThreadsOption(app, &num_threads_, "read, describe and look up scans");
  AddQuietOption(app, &quiet_);
  selection_.Declare(app);
}

absl::Status SlamOptions::CheckUsage() const {
  RETURN_IF_ERROR(selection_.CheckUsage());
  return poses_.CheckUsageWithPoses(scans_dir_);
}

absl::StatusOr<SlamOptions::Drive> SlamOptions::Open() const {
  ASSIGN_OR_RETURN(const dataset::Drive opened, poses_.OpenDrive(scans_dir_));
  ASSIGN_OR_RETURN(std::vector<dataset::Frame> frames, Select(selection_, opened.frames));
  Drive drive{.frames = std::move(frames)};
  drive.plan = PlanOf(DefaultSessionName(poses_.Place(scans_dir_)), drive.frames, mount());
  ASSIGN_OR_RETURN(drive.truth, ReadTruth(drive.frames));
  return drive;
}

absl::StatusOr<std::vector<Pose>> SlamOptions::ReadTruth(
    const std::vector<dataset::Frame>& frames) const {
  std::vector<Pose> truth;
  if (truth_.poses_file().empty()) return truth;
  if (poses_.has_bag()) {
    ASSIGN_OR_RETURN(const dataset::Trajectory trajectory, truth_.ReadTrajectory());
    if (trajectory.T_map_sensor.size() == frames.size()) return trajectory.T_map_sensor;
    return absl::InvalidArgumentError(
        absl::StrCat(truth_.poses_file(), " has ", trajectory.T_map_sensor.size(), " poses, but ",
                     frames.size(), " scans were taken from the bag; give one a scan"));
  }
  ASSIGN_OR_RETURN(const dataset::Drive drive, truth_.OpenDrive(scans_dir_));
  std::map<std::string, Pose> by_name;
  for (const dataset::Frame& frame : drive.frames) by_name[frame.name] = frame.T_map_sensor;
  for (const dataset::Frame& frame : frames) {
    const auto found = by_name.find(frame.name);
    if (found == by_name.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat(truth_.poses_file(), " has no pose for scan ", frame.name));
    }
    truth.push_back(found->second);
  }
  return truth;
}

slam::DriveOptions TellingOptions(int num_threads, StageProgress& progress) {
  slam::DriveOptions options{
      .num_threads = num_threads,
      .progress = [&progress](const char* stage, std::size_t num_done, std::size_t num_total) {
        progress.Update(stage, num_done, num_total);
      }};
  options.graph.is_cancelled = &Interrupted;
  return options;
}

absl::StatusOr<slam::ClosedDrive> AlignPlan(const std::string& map,
                                            const mapdb::ScanLoader& load_scan,
                                            const slam::DriveOptions& options,
                                            mapdb::SessionPlan& plan, const std::string& left_out) {
  ASSIGN_OR_RETURN(Map loaded, mapdb::LoadMap(map));
  ASSIGN_OR_RETURN(slam::ClosedDrive drive,
                   slam::AlignDrive(std::make_shared<const Map>(std::move(loaded)), plan, load_scan,
                                    options, left_out));
  for (std::size_t i = 0; i < plan.scans.size(); ++i) {
    plan.scans[i].T_map_place = drive.T_map_scan[i];
  }
  return drive;
}

slam::DriveOptions SlamOptions::MakeOptions(StageProgress& progress) const {
  slam::DriveOptions options = TellingOptions(num_threads_, progress);
  options.spacing_m = spacing_m_;
  options.window_m = window_m_;
  if (!method_.empty()) options.query.method = *ParseMethod(method_);
  return options;
}

std::vector<Pose> SlamOptions::Told(const std::vector<Pose>& T_map_turned) const {
  std::vector<Pose> told;
  told.reserve(T_map_turned.size());
  const Pose T_turned_base = BaseInTurned(mount());
  for (const Pose& pose : T_map_turned) told.push_back(pose * T_turned_base);
  return told;
}

absl::Status SlamOptions::WritePoses(const report::DriveReport& report, const Drive& drive,
                                     const slam::ClosedDrive& closed) const {
  for (const std::string& path : out_) {
    const std::string format = FormatOf(out_format_, path);
    std::string text;
    if (format == "kitti") {
      text = report::PosesAsKitti(report.after);
    } else if (format == "tum") {
      std::vector<std::int64_t> stamps_ns;
      for (const mapdb::PlannedScan& scan : drive.plan.scans) stamps_ns.push_back(scan.stamp_ns);
      text = report::PosesAsTum(stamps_ns, report.after);
    } else {
      text = report::GraphAsG2o(closed.T_map_scan, EdgesOf(drive.plan, closed));
    }
    RETURN_IF_ERROR(WriteText(path, text));
  }
  return absl::OkStatus();
}

absl::Status SlamOptions::Tell(const std::string& title, const Drive& drive,
                               const slam::ClosedDrive& closed) const {
  report::DriveReport report{.title = title,
                             .after = Told(closed.T_map_scan),
                             .truth = drive.truth,
                             .loops = LoopsOf(drive.plan, closed),
                             .num_looked_at = closed.num_looked_at,
                             .num_passes = closed.num_passes,
                             .drift_m_m = closed.drift.shift_m_m,
                             .drift_rad_m = closed.drift.turn_rad_m,
                             .noise_m = closed.noise.step_m,
                             .noise_rad = closed.noise.step_rad};
  std::vector<Pose> before;
  for (const mapdb::PlannedScan& scan : drive.plan.scans) {
    report.scans.push_back(scan.name);
    before.push_back(scan.T_map_place);
  }
  report.before = Told(before);
  if (report.truth.size() > 1) {
    const auto errors_before = eval::CompareTrajectories(report.truth, report.before);
    const auto errors_after = eval::CompareTrajectories(report.truth, report.after);
    if (!errors_before.ok()) return errors_before.status();
    if (!errors_after.ok()) return errors_after.status();
    report.errors_before = *errors_before;
    report.errors_after = *errors_after;
  }
  RETURN_IF_ERROR(WritePoses(report, drive, closed));
  const std::string json = report::ToText(report::DriveAsJson(report));
  if (!report_dir_.empty()) {
    RETURN_IF_ERROR(WriteReport(report_dir_, {{"results.json", json},
                                              {"loops.csv", report::LoopsAsCsv(report)},
                                              {"report.html", report::DriveAsHtml(report)}}));
  }
  if (json_) return WriteText("-", json);
  return WriteText("-", absl::StrCat(report::DriveAsText(report), "  written       ",
                                     Printable(absl::StrJoin(out_, ", ")), "\n"));
}

}  // namespace scanloc::cli
