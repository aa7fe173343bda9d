#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "absl/status/status.h"
#include "cli/connection_options.hpp"
#include "cli/mount_options.hpp"
#include "lookout.hpp"
#include "node.hpp"
#include "scanloc/client/robot_stream.hpp"

namespace scanloc::ros2 {

/// The command line of scanloc-ros2.
class Options {
 public:
  void Declare(CLI::App& app);

  /// After parsing: fills in what depends on several options. InvalidArgument: they do not go
  /// together.
  [[nodiscard]] absl::Status Finish();

  cli::Connection server;
  std::string map_file;
  client::StreamOptions stream;
  NodeOptions node;
  LookoutOptions lookout;
  bool quiet = false;

 private:
  void DeclareAnswers(CLI::App& app);
  void DeclareModes(CLI::App& app);
  void DeclareTopics(CLI::App& app);
  void DeclareFrames(CLI::App& app);

  bool once_ = false;
  bool until_localized_ = false;
  bool always_ = false;
  bool publish_tf_ = false;
  cli::MountOptions mount_;
  std::string tf_topic_ = "tf";
  std::string reliability_ = "best_effort";
};

}  // namespace scanloc::ros2
