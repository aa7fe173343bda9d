#include "cli/change_detection.hpp"

#include <CLI/CLI.hpp>
#include <utility>

#include "cli/command.hpp"
#include "cli/drive_plan.hpp"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"
#include "cli/slam_options.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/check_session.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {
namespace {

std::vector<report::ReportedChange> SideOf(const std::vector<slam::Observation>& seen,
                                           const std::vector<slam::Comparison>& compared,
                                           const std::vector<std::size_t>& numbers) {
  std::vector<report::ReportedChange> side;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    side.push_back({.number = numbers.empty() ? i : numbers[i],
                    .scan = seen[i].name,
                    .session = seen[i].session,
                    .T_map_scan = seen[i].T_map_scan,
                    .change = slam::ChangeName(compared[i].change),
                    .agreement = compared[i].agreement});
  }
  return side;
}

absl::Status CompareBothWays(const AutoParams& params, int num_threads, DetectedChanges& changes) {
  auto compared = slam::Compare(changes.before, changes.after, params, num_threads);
  if (!compared.ok()) return compared.status();
  changes.of_before = *std::move(compared);
  compared = slam::Compare(changes.after, changes.before, params, num_threads);
  if (!compared.ok()) return compared.status();
  changes.of_after = *std::move(compared);
  return absl::OkStatus();
}

}  // namespace

report::ChangeReport DetectedChanges::Report() const {
  return {.before_name = before_name,
          .after_name = after_name,
          .before = SideOf(before, of_before, {}),
          .after = SideOf(after, of_after, scans)};
}

void ComparedDrive::Declare(CLI::App& app) {
  app.add_option("--scans", scans_dir_, "Folder of the scans of a drive, as of build")
      ->type_name("DIR");
  poses_.Declare(app, "--poses", "Pose of the sensor at each scan, in the frame of the map");
  poses_.DeclareBag(app);
  poses_.DeclareMount(app);
  app.add_option("--session", session_, "Name of the drive [the name of its folder]");
  app.add_flag("--align", align_,
               "The poses are odometry in a frame of their own; bring them into that of the map");
  AddThreadsOption(app, &num_threads_, "read, describe and compare scans");
  AddQuietOption(app, &quiet_);
  selection_.Declare(app);
}

absl::Status ComparedDrive::CheckUsage() const {
  RETURN_IF_ERROR(selection_.CheckUsage());
  return poses_.CheckUsageWithPoses(scans_dir_);
}

absl::Status ComparedDrive::PutIntoFrame(const std::string& map, const slam::DriveOptions& options,
                                         const mapdb::ScanLoader& load_scan,
                                         mapdb::SessionPlan& plan) const {
  if (!align_) return mapdb::CheckFrame(map, plan, load_scan);
  return AlignPlan(map, load_scan, options, plan).status();
}

absl::StatusOr<DetectedChanges> ComparedDrive::CompareWithDrive(const std::string& map) const {
  CatchInterrupts();
  ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(map));
  ASSIGN_OR_RETURN(std::vector<slam::Observation> places, slam::ObserveMap(map));
  ASSIGN_OR_RETURN(const dataset::Drive drive, poses_.OpenDrive(scans_dir_));
  ASSIGN_OR_RETURN(std::vector<dataset::Frame> frames, Select(selection_, drive.frames));

  DetectedChanges changes{.before_name = map, .before = std::move(places)};
  changes.frames = std::move(frames);
  changes.after_name = session_.empty() ? DefaultSessionName(poses_.Place(scans_dir_)) : session_;
  changes.plan = PlanOf(changes.after_name, changes.frames, mount());
  const mapdb::ScanLoader load_scan = LoaderOf(changes.frames, mount());
  StageProgress progress(quiet_);
  const slam::DriveOptions options = TellingOptions(num_threads_, progress);
  RETURN_IF_ERROR(PutIntoFrame(map, options, load_scan, changes.plan));
  absl::StatusOr<std::vector<slam::Observation>> seen =
      slam::ObserveDrive(info.params, changes.plan, load_scan, options, changes.scans);
  progress.Clear();
  if (!seen.ok()) return seen.status();
  changes.after = *std::move(seen);
  RETURN_IF_ERROR(CompareBothWays(info.params.automatic, num_threads_, changes));
  return changes;
}

absl::StatusOr<DetectedChanges> ComparedDrive::CompareWithMap(const std::string& map,
                                                              const std::string& other) const {
  ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(map));
  DetectedChanges changes{.before_name = map, .after_name = other};
  for (const bool is_before : {true, false}) {
    ASSIGN_OR_RETURN(std::vector<slam::Observation> places,
                     slam::ObserveMap(is_before ? map : other));
    (is_before ? changes.before : changes.after) = std::move(places);
  }
  RETURN_IF_ERROR(CompareBothWays(info.params.automatic, num_threads_, changes));
  return changes;
}

}  // namespace scanloc::cli
