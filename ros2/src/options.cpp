#include "options.hpp"

#include "cli/command.hpp"
#include "cli/declared_options.hpp"
#include "scanloc/core/limits.hpp"

namespace scanloc::ros2 {

using cli::InRange;
using cli::OptionGroup;

void Options::Declare(CLI::App& app) {
  DeclareAnswers(app);
  DeclareModes(app);
  DeclareFrames(app);
  cli::RefuseEmptyValues(app);
  DeclareTopics(app);  // an empty name is none, but of the clouds
  mount_.Declare(app);
  app.add_flag("--quiet", quiet, "Tell errors only, not how things stand");
  cli::ShowDefaults(app);
  app.footer(
      "Topics that do not begin with / are in the namespace. CYCLONEDDS_URI configures DDS, as "
      "for\n"
      "rmw_cyclonedds_cpp; without --domain, ROS_DOMAIN_ID is the domain.\n"
      "Prints \"scanloc-ros2 ready\" once it listens. SIGTERM and SIGINT end it.\n"
      "Exit status: 0 done or stopped (\"not recognised\" is an answer), 1 failed, 2 wrong usage.\n"
      "Examples:\n"
      "  scanloc-ros2 --map town.scanloc --points /velodyne_points --once\n"
      "  scanloc-ros2 --server 10.0.0.5:50061 --points /points --odom /odom --until-localized\n"
      "  scanloc-ros2 --map town.scanloc --always --publish-tf --trigger /relocalize");
}

void Options::DeclareAnswers(CLI::App& app) {
  const char* heading = "Who answers";
  auto* address = cli::DeclareConnection(app, heading, &server);
  const OptionGroup group(app, heading);
  app.add_option("--map", map_file, "Map file to answer from, in place of a server")
      ->type_name("FILE")
      ->excludes(address);
  app.add_option("--map-name", stream.map, "Map of the server [the only one]")
      ->type_name("NAME")
      ->needs(address);
  app.add_option("--deadline", server.deadline_s,
                 "Longest that a question to a server may take [s]")
      ->needs(address)
      ->check(InRange(0.01, 3600));
  app.add_option("--candidates", stream.query.max_answers, "Candidates told of each answer")
      ->check(InRange(1, limits::kMaxCandidates));
  app.add_option("--max-step-m", stream.max_step_m,
                 "Without odometry: farthest that the robot goes between two questions [m]")
      ->check(InRange(0.001, 1000));
}

void Options::DeclareModes(CLI::App& app) {
  const OptionGroup group(
      app, "When scans are asked about [until localized; with a trigger, at triggers]");
  auto* once = app.add_flag("--once", once_, "Until there is one answer, whatever it says");
  auto* until = app.add_flag("--until-localized", until_localized_,
                             "Until the robot is localized and who subscribes to the initial pose "
                             "has been told");
  auto* always = app.add_flag("--always", always_,
                              "All the time; says when the robot is lost again, and finds it anew");
  until->excludes(once);
  always->excludes(once)->excludes(until);
  app.add_option("--trigger", node.trigger,
                 "Topic of std_msgs/Empty: each message begins anew; the program then stays")
      ->type_name("TOPIC");
  app.add_option("--interval", lookout.interval_s,
                 "From one question to the next while localized [s]; 0: every scan that there is "
                 "time for")
      ->check(InRange(0, 3600));
  app.add_option("--lost-after", lookout.num_misses_to_lost,
                 "The robot is lost after so many answers in a row that do not find it")
      ->check(InRange(1, 1000));
}

void Options::DeclareTopics(CLI::App& app) {
  const OptionGroup group(app, "Topics");
  const auto topic = [&](const char* name, std::string* value, const char* what) {
    app.add_option(name, *value, what)->type_name("TOPIC");
  };
  topic("--points", &node.points, "Clouds, sensor_msgs/PointCloud2 of any layout");
  topic("--odom", &node.odom, "nav_msgs/Odometry, where there is one");
  topic("--tf-static", &node.tf_static,
        "Where the sensor sits on the robot, tf2_msgs/TFMessage, where there is one");
  topic("--initialpose", &node.initial_pose,
        "Where the robot is, geometry_msgs/PoseWithCovarianceStamped: once when it is found, and "
        "when it is found anew");
  topic("--pose", &node.pose, "The same of every scan that is localized");
  topic("--candidates-topic", &node.candidates, "Candidates of every answer, PoseArray");
  topic("--diagnostics", &node.diagnostics, "diagnostic_msgs/DiagnosticArray, once a second");
  topic("--tf-topic", &tf_topic_, "Transforms, tf2_msgs/TFMessage");
  app.add_option("--domain", node.domain, "DDS domain")
      ->envname("ROS_DOMAIN_ID")
      ->check(InRange(0, 230));
  app.add_option("--namespace", node.ros_namespace, "Namespace of the topics [none]")
      ->type_name("NAME");
  app.add_option("--reliability", reliability_,
                 "best_effort takes clouds of every publisher; reliable has lost ones sent again, "
                 "if the publisher does that")
      ->check(CLI::IsMember({"best_effort", "reliable"}))
      ->type_name("TEXT");
  app.add_option("--depth", node.depth, "Clouds kept until they are looked at")
      ->check(InRange(1, 1000));
}

void Options::DeclareFrames(CLI::App& app) {
  const OptionGroup group(app, "Frames");
  app.add_option("--map-frame", lookout.map_frame, "Name of the map's frame")->type_name("NAME");
  app.add_option(
         "--base-frame", lookout.base_frame,
         "Name of the robot's frame, whose pose is told; by --tf-static it leads to that of "
         "the clouds")
      ->type_name("NAME");
  app.add_option("--odom-frame", lookout.odom_frame,
                 "Name of the odometry's frame [as its messages say]")
      ->type_name("NAME");
  app.add_flag("--publish-tf", publish_tf_,
               "Publish map -> odom, at every message of odometry while localized; the program "
               "then stays");
  app.add_flag(
      "--deskew,!--no-deskew", lookout.deskews,
      "Take the robot's motion during a sweep out of it, where points have times and there "
      "is odometry of that time [yes]");
  app.add_option("--odom-wait", lookout.odometry_wait_s,
                 "Longest that a scan waits for odometry of its time [s]")
      ->check(InRange(0, 10));
}

absl::Status Options::Finish() {
  if (map_file.empty() && server.address.empty()) {
    return absl::InvalidArgumentError("give --server HOST:PORT or --map FILE");
  }
  if (node.points.empty()) {
    return absl::InvalidArgumentError("--points: its value is empty; give one, or leave it out");
  }
  if (publish_tf_ && node.odom.empty()) {
    return absl::InvalidArgumentError("--publish-tf needs --odom");
  }
  lookout.mount = mount_.mount();
  lookout.knows_base = mount_.has_base();
  if (once_) lookout.mode = Mode::kOnce;
  if (always_) lookout.mode = Mode::kAlways;
  lookout.asks_at_start = node.trigger.empty() || once_ || until_localized_ || always_;
  lookout.stays = publish_tf_ || !node.trigger.empty();
  lookout.publishes_tf = publish_tf_;
  if (publish_tf_) node.tf = tf_topic_;
  if (node.initial_pose.empty() && lookout.mode == Mode::kUntilLocalized && !publish_tf_) {
    return absl::InvalidArgumentError(
        "--until-localized needs --initialpose, --publish-tf, or another mode");
  }
  node.is_reliable = reliability_ == "reliable";
  return absl::OkStatus();
}

}  // namespace scanloc::ros2
