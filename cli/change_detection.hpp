#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "cli/drive_options.hpp"
#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/report/change_report.hpp"
#include "scanloc/slam/compare.hpp"

namespace scanloc::cli {

/// What both sides of a comparison see, and what of it has changed.
struct DetectedChanges {
  std::string before_name;
  std::string after_name;
  std::vector<slam::Observation> before;
  std::vector<slam::Observation> after;
  std::vector<slam::Comparison> of_before;
  std::vector<slam::Comparison> of_after;
  // Of a drive:
  std::vector<dataset::Frame> frames;
  mapdb::SessionPlan plan;         ///< in the frame of the map
  std::vector<std::size_t> scans;  ///< numbers in the plan of what is in `after`

  [[nodiscard]] report::ChangeReport Report() const;
};

/// A drive that a map is compared with, as options of the command line: what `diff` and `refresh`
/// share.
class ComparedDrive {
 public:
  void Declare(CLI::App& app);
  [[nodiscard]] absl::Status CheckUsage() const;
  [[nodiscard]] bool given() const { return !scans_dir_.empty() || poses_.has_bag(); }

  [[nodiscard]] absl::StatusOr<DetectedChanges> CompareWithDrive(const std::string& map) const;
  [[nodiscard]] absl::StatusOr<DetectedChanges> CompareWithMap(const std::string& map,
                                                               const std::string& other) const;

  [[nodiscard]] const SensorMount& mount() const { return poses_.mount(); }
  [[nodiscard]] int num_threads() const { return num_threads_; }
  [[nodiscard]] bool quiet() const { return quiet_; }

 private:
  /// Poses of the plan in the frame of the map: brought there, or checked.
  [[nodiscard]] absl::Status PutIntoFrame(const std::string& map, const slam::DriveOptions& options,
                                          const mapdb::ScanLoader& load_scan,
                                          mapdb::SessionPlan& plan) const;

  std::string scans_dir_;
  PoseOptions poses_;
  ScanSelection selection_;
  std::string session_;
  bool align_ = false;
  int num_threads_ = 0;
  bool quiet_ = false;
};

}  // namespace scanloc::cli
