#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "cli/command.hpp"
#include "cli/output.hpp"
#include "cli/progress.hpp"
#include "scanloc/jobs/jobs.hpp"
#include "scanloc/sim/drive_writer.hpp"
#include "scanloc/sim/simulated_drive.hpp"

namespace scanloc::cli {
namespace {

class SimulateCommand : public Command {
 public:
  SimulateCommand()
      : Command("simulate",
                "Make a LiDAR drive through a made town or another world, as KITTI folders") {}
  void Declare(CLI::App& app) override {
    app.add_option(
           "OUT", out_,
           "Folder to make: velodyne/000000.bin ..., poses.txt (T_map_sensor) and times.txt")
        ->required();
    DeclareWorld(app);
    DeclareSession(app);
    DeclareLidar(app);
    AddThreadsOption(app, &num_threads_, "cast scans");
    AddQuietOption(app, &quiet_);
    app.footer(
        "The same options always give the same bytes. Drives of the same town (--town-seed and\n"
        "--length-m) share one map frame, so one can be mapped and another looked up in it.\n"
        "Examples:\n"
        "  scanloc simulate monday --town-seed 7 --session-seed 1 --length-m 1000\n"
        "  scanloc simulate tuesday --town-seed 7 --session-seed 2 --length-m 1000 --reverse "
        "--lane-shift-m 3.5\n"
        "  scanloc simulate robot --world office --floors 6 --sensor-height-m 0.3 --rays 16 "
        "--spacing-m 1\n"
        "  scanloc simulate lift --world warehouse --mount-deg 0,45,0 --to-m 300");
  }
  [[nodiscard]] absl::Status CheckUsage() const override { return Validate(Options()); }
  [[nodiscard]] absl::Status Run() override {
    const auto start = std::chrono::steady_clock::now();
    const auto num_threads = static_cast<int>(std::min<std::size_t>(NumThreads(num_threads_), 256));
    std::size_t num_scans = 0;
    {
      Progress progress("scans cast", quiet_);
      absl::Status status = sim::Simulate(Options(), out_, num_threads,
                                          [&](std::size_t num_done, std::size_t num_total) {
                                            num_scans = num_total;
                                            progress.Update(num_done, num_total);
                                          });
      if (!status.ok()) return status;
    }
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    return WriteText(
        "-", absl::StrFormat("wrote %d scans to %s in %.1f s\n", num_scans, out_, elapsed.count()));
  }

 private:
  void DeclareWorld(CLI::App& app) {
    const OptionGroup group(app, "The world");
    app.add_option_function<std::string>(
           "--world",
           [this](const std::string& name) { options_.world.kind = *sim::ParseWorldKind(name); },
           absl::StrCat("What is driven or walked through: ",
                        absl::StrJoin(sim::WorldKindNames(), ", ")))
        ->check(ParsedBy(&sim::ParseWorldKind))
        ->default_str("town");
    app.add_option("--town-seed,--world-seed", options_.town.town_seed,
                   "Another number, another town or other world");
    app.add_option("--length-m", length_m_,
                   "Length of the route [m]: part of what a town, campus, forest or tunnel "
                   "is [1000]; in other worlds the route ends there at the latest [all]");
    app.add_option(
        "--rebuilt-share", options_.town.rebuilt_share,
        "Share of a town's route along which everything was torn down and built anew, in [0, 1]; "
        "rebuilt.txt then tells how far each scan is from there");
    app.add_option("--rebuilt-seed", options_.town.rebuilt_seed,
                   "Another number, other streets that were rebuilt and other houses");
    app.add_option("--floors", options_.world.num_floors,
                   "Storeys of an office, decks of a garage");
    app.add_option("--aisles", options_.world.num_aisles, "Aisles of a warehouse");
    app.add_option(
        "--changed-share", options_.world.changed_share,
        "Share of furniture and stock that differs between any two sessions, in [0, 1]; not of "
        "towns");
  }
  void DeclareSession(CLI::App& app) {
    sim::SessionOptions& session = options_.session;
    const OptionGroup group(app, "The drive");
    app.add_option("--session-seed", session.session_seed,
                   "Another number: other traffic, driving and noise");
    app.add_option(
        "--lane-shift-m", session.lane_shift_m,
        "How far left of the right-hand lane the vehicle keeps, seen along the route [m]");
    app.add_flag("--reverse", session.reverse, "Drive the route from its end to its beginning");
    app.add_option("--spacing-m", session.spacing_m, "Distance between scans [m]");
    app.add_option("--tilt-deg", session.tilt_deg,
                   "Roll and pitch of each scan are random within ± this [deg]");
    app.add_option("--sensor-height-m", session.sensor_height_m,
                   "Height of the sensor above ground [m]");
    app.add_option(
           "--mount-deg", mount_deg_,
           "Roll, pitch and yaw of the sensor on what carries it, with commas between [deg]")
        ->delimiter(',')
        ->expected(3);
    app.add_option("--from-m", session.from_m, "Drive the route from here on [m]");
    app.add_option("--to-m", session.to_m, "Drive it up to here; 0: to its end [m]");
    app.add_option("--odometry-noise", session.odometry_noise_percent,
                   "Write odometry.txt, too: the poses as reckoned on the way, wrong by about so "
                   "many per cent "
                   "of it");
    app.add_option("--parked-share", session.parked_share,
                   "Share of parking slots taken, in [0, 1]");
    app.add_option("--moving-per-km", session.moving_per_km, "Moving vehicles per km of street");
  }
  void DeclareLidar(CLI::App& app) {
    sim::LidarOptions& lidar = options_.lidar;
    const OptionGroup group(app, "The LiDAR");
    app.add_option("--rays", lidar.num_rays, "Rays one above the other, 16 to 128");
    app.add_option("--azimuths", lidar.num_azimuths, "Directions in a full turn");
    app.add_option("--fov-deg", lidar.fov_deg, "Azimuths seen, centred on forward [deg]");
    app.add_option("--min-elevation-deg", lidar.min_elevation_deg,
                   "Elevation of the lowest ray [deg]");
    app.add_option("--max-elevation-deg", lidar.max_elevation_deg,
                   "Elevation of the highest ray [deg]");
    app.add_option("--max-range-m", lidar.max_range_m, "Range of the sensor [m]");
    app.add_option("--range-sigma-m", lidar.range_sigma_m,
                   "Noise along the beam, standard deviation [m]");
    app.add_option("--dropout", lidar.dropout,
                   "Share of returns lost near the sensor; more are lost far away");
  }

  [[nodiscard]] sim::SimulateOptions Options() const {
    sim::SimulateOptions options = options_;
    if (mount_deg_.size() == 3) {
      options.session.mount_deg = Eigen::Map<const Eigen::Vector3d>(mount_deg_.data());
    }
    if (length_m_) {
      options.town.length_m = *length_m_;
    } else if (!sim::IsMadeForLength(options.world.kind)) {
      options.town.length_m = sim::kWholeRoute_m;
    }
    return options;
  }

  std::string out_;
  sim::SimulateOptions options_;
  std::vector<double> mount_deg_;
  std::optional<double> length_m_;
  int num_threads_ = 0;
  bool quiet_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeSimulateCommand() { return std::make_unique<SimulateCommand>(); }

}  // namespace scanloc::cli
