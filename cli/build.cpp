#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cli/calibrate.hpp"
#include "cli/command.hpp"
#include "cli/drive_options.hpp"
#include "cli/drive_plan.hpp"
#include "cli/geo_options.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "cli/param_options.hpp"
#include "cli/progress.hpp"
#include "cli/slam_options.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/dataset/drive.hpp"
#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/mapdb/check_session.hpp"
#include "scanloc/mapdb/fix_params.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {
namespace {

/// What a build read, beside what mapdb::BuildSummary counts.
struct ReadCounts {
  std::atomic<std::int64_t> num_not_finite = 0;  ///< left out by the reader
  std::atomic<std::int64_t> num_masked = 0;      ///< left out by the mount
};

class BuildCommand : public Command {
 public:
  BuildCommand() : Command("build", "Build a map file from the scans and poses of a drive") {}
  void Declare(CLI::App& app) override {
    app.add_option("MAP", map_, "Map file to make, by custom *.scanloc")->required();
    app.add_option("--scans", scans_dir_,
                   "Folder of the scans (.bin, .npy, .pcd, .ply), or one with a folder velodyne, "
                   "sensor_data/Ouster, train/lidars or the like")
        ->type_name("DIR");
    poses_.Declare(
        app, "--poses",
        "Pose of the sensor at each scan: the i-th row is that of the i-th scan by name");
    poses_.DeclareBag(app);
    poses_.DeclareMount(app);
    app.add_option("--session", session_, "Name of this drive in the map [the name of its folder]");
    app.add_option("--spacing-m", spacing_m_, "Distance between places; 0 keeps every scan [m]")
        ->check(InRange(0.0, 1e6));
    app.add_flag("--append", append_, "Add the drive to a map as a further session");
    app.add_flag("--align", align_,
                 "With --append: the poses are odometry in a frame of their own; bring them into "
                 "that of the map first, as scanloc align does");
    app.add_flag("--resume", resume_,
                 "Go on with a build that was stopped; give it the same options");
    app.add_flag("--calibrate,!--no-calibrate", calibrate_,
                 "Find out at the end which places would be taken for each other, which takes some "
                 "seconds [yes]");
    app.add_flag("--skip-bad-scans", skip_bad_scans_,
                 "Pass over scans that cannot be read, instead of stopping");
    app.add_flag(
        "--accept-inconsistent", accept_inconsistent_,
        "Build though the poses contradict what the scans show, or, with --append, stand in "
        "another frame than the map");
    app.add_option("--commit-interval", commit_interval_,
                   "Scans that are lost at most when the build is killed")
        ->check(InRange(1, 1e6));
    AddThreadsOption(app, &num_threads_, "read and describe scans");
    AddQuietOption(app, &quiet_);
    geo_.Declare(app);
    selection_.Declare(app);
    params_.Declare(app);
    app.footer(
        "A build that is stopped, by Ctrl-C or in any other way, keeps what it had written; the "
        "same\n"
        "command with --resume goes on there and ends in the same map.\n"
        "Examples:\n"
        "  scanloc build town.scanloc --scans drive1 --poses drive1/poses.txt\n"
        "  scanloc build kitti00.scanloc --scans sequences/00 --poses poses/00.txt --calib "
        "sequences/00/calib.txt\n"
        "  scanloc build kaist.scanloc --scans KAIST03 --poses KAIST03/global_pose.csv\n"
        "  scanloc build town.scanloc --scans drive2 --poses drive2/poses.txt --append\n"
        "  scanloc build yard.scanloc --bag drive.mcap --poses-from /odom\n"
        "  scanloc build hall.scanloc --scans drive1 --poses base.txt --T-base-sensor "
        "0.2,0,1.1,180,0,0\n"
        "  scanloc build half.scanloc --scans drive1 --poses drive1/poses.txt --every 2");
  }
  [[nodiscard]] absl::Status CheckUsage() const override {
    RETURN_IF_ERROR(selection_.CheckUsage());
    RETURN_IF_ERROR(geo_.CheckUsage());
    RETURN_IF_ERROR(poses_.CheckUsageWithPoses(scans_dir_));
    if (align_ && !append_) {
      return absl::InvalidArgumentError("--align is for --append: it aligns a drive with a map");
    }
    if (append_ && params_.given()) {
      return absl::InvalidArgumentError(
          "with --append the parameters are those that the map was made with; leave out the "
          "options "
          "that set them");
    }
    return params_.Make().status();
  }
  [[nodiscard]] absl::Status Run() override {
    const auto start = std::chrono::steady_clock::now();
    CatchInterrupts();
    RETURN_IF_ERROR(geo_.Read());
    ASSIGN_OR_RETURN(const std::vector<dataset::Frame> selected, ChooseFrames());
    const std::vector<dataset::Frame> frames = Thinned(selected, spacing_m_);
    num_too_near_ = selected.size() - frames.size();

    mapdb::SessionPlan plan =
        PlanOf(session_.empty() ? DefaultSessionName(poses_.Place(scans_dir_)) : session_, frames,
               poses_.mount());
    const mapdb::ScanLoader load_scan = LoaderOf(frames, poses_.mount());
    std::string aligned;
    if (align_) {
      ASSIGN_OR_RETURN(aligned, Align(load_scan, plan));
    }
    ASSIGN_OR_RETURN(const mapdb::BuildOptions options, MakeBuildOptions(plan, load_scan));
    RETURN_IF_ERROR(CheckConsistency(options, selected, plan, load_scan));
    ReadCounts counts;
    ASSIGN_OR_RETURN(const mapdb::BuildSummary summary, Build(options, plan, frames, &counts));

    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    std::string text = absl::StrFormat(
        "built %s in %.1f s\n"
        "  session     %s\n"
        "  places      %d new, %d in the map\n"
        "  left out    %d scans less than %g m from the place before, or at a standstill "
        "(--spacing-m)\n"
        "  skipped     %d scans without a point in range, %d that could not be read\n"
        "  points      %d used, %d that are not finite left out\n"
        "  scale       %g\n"
        "  content id  %s\n",
        Printable(map_), elapsed.count(), Printable(plan.name), summary.num_places,
        summary.num_places_in_map, num_too_near_, spacing_m_, summary.num_empty,
        summary.num_unreadable, summary.num_points,
        summary.num_points_not_finite + counts.num_not_finite.load(),
        options.params.automatic.scale, summary.content_id);
    text += aligned;
    if (counts.num_masked > 0) {
      absl::StrAppend(&text, "  not seen    ", counts.num_masked.load(),
                      " points, as --min-range-m and --self-box say\n");
    }
    if (summary.num_unreadable > 0) {
      absl::StrAppend(
          &text, "  the first that could not be read: ", Printable(summary.first_unreadable), "\n");
    }
    const absl::StatusOr<std::string> on_earth = geo_.Apply(map_);
    if (!on_earth.ok()) {
      return absl::Status(
          on_earth.status().code(),
          absl::StrCat(
              on_earth.status().message(), "; map ", map_,
              " holds all its places, but not where on earth they are: give the same command "
              "with --resume and another --geo-fixes or none"));
    }
    text += *on_earth;
    if (!calibrate_) return WriteText("-", text);
    const absl::StatusOr<std::string> calibration = CalibrateAndTell(map_, num_threads_, quiet_);
    if (absl::IsCancelled(calibration.status())) {
      return absl::CancelledError(absl::StrCat(
          calibration.status().message(), "; map ", map_,
          " holds all its places: give the same command with --resume to calibrate it"));
    }
    if (!calibration.ok()) return calibration.status();
    return WriteText("-", text + *calibration);
  }

 private:
  /// The frames of the drive that are selected.
  [[nodiscard]] absl::StatusOr<std::vector<dataset::Frame>> ChooseFrames() const {
    ASSIGN_OR_RETURN(const dataset::Drive drive, poses_.OpenDrive(scans_dir_));
    return Select(selection_, drive.frames);
  }
  [[nodiscard]] absl::StatusOr<mapdb::BuildOptions> MakeBuildOptions(
      const mapdb::SessionPlan& plan, const mapdb::ScanLoader& load_scan) const {
    mapdb::BuildOptions options{
        .path = map_,
        .mode = append_ ? mapdb::BuildMode::kAppend : mapdb::BuildMode::kCreate,
        .num_threads = num_threads_,
        .commit_interval = commit_interval_,
        .skip_unreadable = skip_bad_scans_};
    ASSIGN_OR_RETURN(options.params, params_.Make());
    RETURN_IF_ERROR(mapdb::FixParams({.resume = resume_, .learn_scale = params_.learns_scale()},
                                     plan, load_scan, options));
    return options;
  }
  /// InvalidArgument where the poses of the selected frames contradict the scans, or those of the
  /// plan the map that is appended to.
  [[nodiscard]] absl::Status CheckConsistency(const mapdb::BuildOptions& options,
                                              const std::vector<dataset::Frame>& selected,
                                              const mapdb::SessionPlan& plan,
                                              const mapdb::ScanLoader& load_scan) const {
    if (accept_inconsistent_ || options.mode == mapdb::BuildMode::kResume) return absl::OkStatus();
    absl::Status status =
        align_ ? mapdb::CheckPoses(options.params, plan, 0.0, load_scan)
               : mapdb::CheckPoses(options.params, PlanOf(plan.name, selected, poses_.mount()),
                                   spacing_m_, LoaderOf(selected, poses_.mount()));
    const char* mend = "";
    if (status.ok() && options.mode == mapdb::BuildMode::kAppend) {
      status = mapdb::CheckFrame(map_, plan, load_scan);
      mend = " by --append --align";
    }
    if (!absl::IsInvalidArgument(status)) return status;
    return absl::InvalidArgumentError(
        absl::StrCat(status.message(), mend,
                     ". Nothing was written; --accept-inconsistent builds all the same"));
  }
  /// Brings the poses of the plan into the frame of the map; a line that tells of it.
  [[nodiscard]] absl::StatusOr<std::string> Align(const mapdb::ScanLoader& load_scan,
                                                  mapdb::SessionPlan& plan) const {
    if (resume_) {
      RETURN_IF_ERROR(mapdb::RecoverMap(map_).status());
    }
    StageProgress progress(quiet_);
    // What a build that was stopped had written of the session is left out, so that it goes on with
    // the poses that it began with.
    const absl::StatusOr<slam::ClosedDrive> drive =
        AlignPlan(map_, load_scan, TellingOptions(num_threads_, progress), plan, plan.name);
    progress.Clear();
    if (!drive.ok()) return drive.status();
    return absl::StrFormat(
        "  aligned     by %d of %d constraints that were found; %d contradict the rest\n",
        drive->num_on(), drive->constraints.size(), drive->constraints.size() - drive->num_on());
  }
  [[nodiscard]] absl::StatusOr<mapdb::BuildSummary> Build(const mapdb::BuildOptions& options,
                                                          const mapdb::SessionPlan& plan,
                                                          const std::vector<dataset::Frame>& frames,
                                                          ReadCounts* counts) const {
    Progress progress("scans built", quiet_);
    mapdb::BuildProgress last;
    absl::StatusOr<mapdb::BuildSummary> summary = mapdb::BuildMap(
        options, plan,
        [&](std::size_t i) -> absl::StatusOr<PointCloud> {
          if (Interrupted()) return absl::CancelledError("interrupted");
          absl::StatusOr<SeenScan> seen = ReadSeenScan(frames[i].file(), poses_.mount());
          if (!seen.ok()) return skip_bad_scans_ ? seen.status() : WithSkipHint(seen.status());
          counts->num_not_finite += static_cast<std::int64_t>(seen->scan.num_not_finite);
          counts->num_masked += static_cast<std::int64_t>(seen->num_masked);
          return std::move(seen->scan.points);
        },
        [&](const mapdb::BuildProgress& now) {
          last = now;
          progress.Update(now.num_done, now.num_scans);
        });
    if (absl::IsCancelled(summary.status())) {
      return absl::CancelledError(absl::StrCat(
          "interrupted after ", last.num_done, " of ", plan.scans.size(), " scans; ", map_,
          " keeps what was built: go on by giving the same command with --resume"));
    }
    if (absl::IsInvalidArgument(summary.status()) && last.num_done == 0) {
      std::string text(summary.status().message());
      if (counts->num_not_finite > 0) {
        absl::StrAppend(&text, "; beside these, ", counts->num_not_finite.load(),
                        " points that are not finite were left out");
      }
      if (counts->num_masked > 0) {
        absl::StrAppend(&text, "; --min-range-m and --self-box left out ",
                        counts->num_masked.load(), " points");
      }
      return absl::InvalidArgumentError(text);
    }
    return summary;
  }

  std::string map_;
  std::string scans_dir_;
  PoseOptions poses_;
  ScanSelection selection_;
  std::string session_;
  double spacing_m_ = 1.0;
  std::size_t num_too_near_ = 0;  ///< left out by the spacing
  ParamOptions params_;
  bool append_ = false;
  bool align_ = false;
  bool resume_ = false;
  bool calibrate_ = true;
  bool skip_bad_scans_ = false;
  bool accept_inconsistent_ = false;
  int commit_interval_ = mapdb::BuildOptions().commit_interval;
  int num_threads_ = 0;
  bool quiet_ = false;
  GeoOptions geo_;
};

}  // namespace

std::unique_ptr<Command> MakeBuildCommand() { return std::make_unique<BuildCommand>(); }

}  // namespace scanloc::cli
