#pragma once

#include <CLI/App.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "cli/drive_options.hpp"
#include "cli/progress.hpp"
#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/report/drive_report.hpp"
#include "scanloc/slam/close_loops.hpp"

namespace scanloc::cli {

/// With this many threads, telling progress, and stopped by an interruption.
[[nodiscard]] slam::DriveOptions TellingOptions(int num_threads, StageProgress& progress);

/// Brings the poses of a plan, odometry in a frame of its own, into that of a map file. What the
/// map has of a session of the name left_out, it does not count. Errors as of AlignDrive and
/// LoadMap.
[[nodiscard]] absl::StatusOr<slam::ClosedDrive> AlignPlan(const std::string& map,
                                                          const mapdb::ScanLoader& load_scan,
                                                          const slam::DriveOptions& options,
                                                          mapdb::SessionPlan& plan,
                                                          const std::string& left_out = "");

/// A drive with odometry in, its poses made to agree out: the options and texts that `optimize` and
/// `align` share.
class SlamOptions {
 public:
  void Declare(CLI::App& app);
  [[nodiscard]] absl::Status CheckUsage() const;

  /// The drive, as its odometry has it. `frames` outlives what is made of it.
  struct Drive {
    std::vector<dataset::Frame> frames;
    mapdb::SessionPlan plan;
    std::vector<Pose> truth;  ///< of the sensor, or of the base where that is told; or empty
  };
  [[nodiscard]] absl::StatusOr<Drive> Open() const;

  [[nodiscard]] const SensorMount& mount() const { return poses_.mount(); }
  [[nodiscard]] int num_threads() const { return num_threads_; }
  [[nodiscard]] bool quiet() const { return quiet_; }

  /// `progress` must outlive them.
  [[nodiscard]] slam::DriveOptions MakeOptions(StageProgress& progress) const;

  /// Writes the poses and the report, and tells on stdout.
  [[nodiscard]] absl::Status Tell(const std::string& title, const Drive& drive,
                                  const slam::ClosedDrive& closed) const;

 private:
  [[nodiscard]] absl::StatusOr<std::vector<Pose>> ReadTruth(
      const std::vector<dataset::Frame>& frames) const;
  /// Of what poses are told of: the base where --T-base-sensor was given, else the sensor.
  [[nodiscard]] std::vector<Pose> Told(const std::vector<Pose>& T_map_turned) const;
  [[nodiscard]] absl::Status WritePoses(const report::DriveReport& report, const Drive& drive,
                                        const slam::ClosedDrive& closed) const;

  std::string scans_dir_;
  PoseOptions poses_;
  PoseOptions truth_;
  ScanSelection selection_;
  std::vector<std::string> out_;
  std::string out_format_ = "auto";
  std::string report_dir_;
  std::string method_;
  double spacing_m_ = slam::DriveOptions().spacing_m;
  double window_m_ = slam::DriveOptions().window_m;
  int num_threads_ = 0;
  bool json_ = false;
  bool quiet_ = false;
};

}  // namespace scanloc::cli
