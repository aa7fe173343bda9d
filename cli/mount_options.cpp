#include "cli/mount_options.hpp"

#include <CLI/CLI.hpp>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::cli {
CLI::Option* MountOptions::Declare(CLI::App& app) {
  const OptionGroup group(app, "How the sensor sits on the robot");
  CLI::Option* base = AddParsedOption(
      app, "--T-base-sensor", [this](const std::string& text) { return TakeBase(text); },
      "The sensor's frame in the robot's base frame [m, degrees]: scans are turned upright, poses "
      "given are those of the base, and so are those told [the base is the sensor]");
  base->type_name("x,y,z,roll,pitch,yaw");
  app.add_option("--min-range-m", mount_.min_range_m,
                 "Points nearer to the sensor than this are not seen [m]")
      ->check(InRange(0.0, kMaxMinRange_m));
  AddParsedOption(
      app, "--self-box", [this](const std::string& text) { return TakeSelfBox(text); },
      "Points in this box of the base frame are not seen: the robot itself, a trailer [m]")
      ->type_name("X0,Y0,Z0,X1,Y1,Z1");
  return base;
}

absl::Status MountOptions::TakeBase(const std::string& text) {
  ASSIGN_OR_RETURN(const auto numbers, ParseNumbers(text, 6, "x,y,z,roll,pitch,yaw"));
  const std::vector<double>& n = numbers;
  ASSIGN_OR_RETURN(mount_.T_base_sensor, MountPose({n[0], n[1], n[2]}, {n[3], n[4], n[5]}));
  has_base_ = true;
  return absl::OkStatus();
}

absl::Status MountOptions::TakeSelfBox(const std::string& text) {
  ASSIGN_OR_RETURN(const auto numbers, ParseNumbers(text, 6, "X0,Y0,Z0,X1,Y1,Z1"));
  const std::vector<double>& n = numbers;
  mount_.self_box = Box{{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
  return Validate(mount_);
}

absl::StatusOr<SeenScan> ReadSeenScan(const dataset::ScanFile& file, const SensorMount& mount) {
  ASSIGN_OR_RETURN(dataset::Scan scan, dataset::ReadScan(file));
  SeenScan seen{.scan = std::move(scan)};
  PointCloud buffer;
  const std::size_t num_given = seen.scan.points.size();
  const PointView left = Seen(mount, seen.scan.points, buffer);
  seen.num_masked = num_given - left.size();
  if (left.data() != seen.scan.points.data()) seen.scan.points = std::move(buffer);
  return seen;
}

absl::StatusOr<dataset::Scan> ReadSeenIntensities(const dataset::ScanFile& file,
                                                  const SensorMount& mount) {
  absl::StatusOr<dataset::Scan> scan = dataset::ReadScanWithIntensities(file);
  if (!scan.ok()) return scan;
  dataset::Scan seen;
  PointCloud one;
  for (std::size_t i = 0; i < scan->points.size(); ++i) {
    for (const Point& point : Seen(mount, PointView(scan->points).subspan(i, 1), one)) {
      seen.points.push_back(point);
      seen.intensities.push_back(scan->intensities[i]);
    }
  }
  return seen;
}

absl::Status WithSkipHint(const absl::Status& error) {
  if (absl::IsCancelled(error)) return error;
  return {error.code(), absl::StrCat(error.message(), "; --skip-bad-scans passes over such scans")};
}

}  // namespace scanloc::cli
