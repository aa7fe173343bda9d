#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "scanloc/core/scan/pose.hpp"
#include "scanloc/eval/trajectory_error.hpp"
#include "scanloc/report/json.hpp"

namespace scanloc::report {

/// A scan that was found where another was taken, or in a map.
struct ReportedLoop {
  std::string from;  ///< name of the earlier scan; empty: the map
  std::string to;
  std::optional<std::size_t> from_scan;  ///< numbers in the drive
  std::size_t to_scan = 0;
  double confidence = 0.0;
  bool is_on = false;    ///< false: switched off
  double error_m = 0.0;  ///< of the result, from what it says
  double error_deg = 0.0;
  double chi2 = 0.0;  ///< squared, in its own standard deviations
};

/// A drive whose poses were made to agree.
struct DriveReport {
  std::string title;
  std::vector<std::string> scans;  ///< names
  std::vector<Pose> before;        ///< odometry; one a scan, as are the others
  std::vector<Pose> after;
  std::vector<Pose> truth;  ///< empty: not known
  std::vector<ReportedLoop> loops;
  std::size_t num_looked_at = 0;
  int num_passes = 0;
  Eigen::Vector3d drift_m_m = Eigen::Vector3d::Zero();  ///< as slam's Drift
  Eigen::Vector3d drift_rad_m = Eigen::Vector3d::Zero();
  double noise_m = 0.0;  ///< of odometry by chance, a step of a metre [1σ]
  double noise_rad = 0.0;
  std::optional<eval::TrajectoryErrors> errors_before;
  std::optional<eval::TrajectoryErrors> errors_after;

  [[nodiscard]] double length_m() const;  ///< of the way, after
  [[nodiscard]] std::size_t num_on() const;
};

/// Lines for people.
[[nodiscard]] std::string DriveAsText(const DriveReport& report);
/// Counts, drift and errors; each loop, but no poses.
[[nodiscard]] Json DriveAsJson(const DriveReport& report);
/// One row a loop: from, to, is_on, confidence, error_m, error_deg, chi2.
[[nodiscard]] std::string LoopsAsCsv(const DriveReport& report);
/// One HTML page that needs no other file: figures, trajectories, residuals, what was switched off.
[[nodiscard]] std::string DriveAsHtml(const DriveReport& report);

}  // namespace scanloc::report
