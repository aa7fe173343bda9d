#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "cli/connection_options.hpp"
#include "cli/drive_options.hpp"
#include "scanloc/client/robot_stream.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/query.hpp"

namespace scanloc::cli {

/// What the command line of `locate` says.
struct LocateOptions {
  void Declare(CLI::App& app);
  /// InvalidArgument: options that do not go together.
  [[nodiscard]] absl::Status CheckUsage() const;
  [[nodiscard]] Query MakeQuery(const Params& params) const;

  std::string map;
  std::string scan;
  std::string scans_dir;
  std::string replay;
  ScanSelection selection;
  bool skip_bad_scans = false;
  bool quiet = false;

  std::string method;
  std::optional<int> num_candidates;
  std::optional<double> threshold;
  std::optional<double> min_confidence;
  std::optional<int> budget_ms;
  int top = 1;
  Prior prior;

  std::string csv;
  bool json = false;

  Connection server;
  std::string map_name;  ///< at the server
  std::string send = "scan";

  PoseOptions truth;
  bool bag_truth = false;
  [[nodiscard]] bool has_truth() const { return bag_truth || !truth.poses_file().empty(); }
  double within_m = 8.0;

  bool sequence = false;
  std::string odometry;
  double max_step_m = client::StreamOptions().max_step_m;

 private:
  void DeclareQuery(CLI::App& app);
  void DeclarePrior(CLI::App& app);
  void DeclareServer(CLI::App& app);
  void DeclareTruth(CLI::App& app);
  void DeclareSequence(CLI::App& app);
};

}  // namespace scanloc::cli
