#pragma once

#include <CLI/App.hpp>
#include <cstddef>
#include <string>

#include "absl/status/statusor.h"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/dataset/scan_reader.hpp"

namespace scanloc::cli {

/// How the sensor sits on the robot, as options of the command line.
class MountOptions {
 public:
  /// Declares --T-base-sensor, --min-range-m and --self-box; what they refuse is wrong usage.
  /// The first of them is returned.
  CLI::Option* Declare(CLI::App& app);

  [[nodiscard]] const SensorMount& mount() const { return mount_; }
  /// Whether --T-base-sensor was given: poses are then those of the base.
  [[nodiscard]] bool has_base() const { return has_base_; }

 private:
  [[nodiscard]] absl::Status TakeBase(const std::string& text);
  [[nodiscard]] absl::Status TakeSelfBox(const std::string& text);

  SensorMount mount_;
  bool has_base_ = false;
};

/// A scan as the mount has it seen.
struct SeenScan {
  dataset::Scan scan;          ///< in the turned frame
  std::size_t num_masked = 0;  ///< points that the mount leaves out
};
[[nodiscard]] absl::StatusOr<SeenScan> ReadSeenScan(const dataset::ScanFile& file,
                                                    const SensorMount& mount);
/// With the intensities of the points that are seen.
[[nodiscard]] absl::StatusOr<dataset::Scan> ReadSeenIntensities(const dataset::ScanFile& file,
                                                                const SensorMount& mount);

/// The error of a scan that cannot be read, with the option that passes over it.
[[nodiscard]] absl::Status WithSkipHint(const absl::Status& error);

}  // namespace scanloc::cli
