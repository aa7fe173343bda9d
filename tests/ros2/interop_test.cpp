// scanloc-ros2 among participants of another implementation of DDS, on loopback.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <numbers>
#include <thread>

#include "ros2/running_node.hpp"
#include "socket_drops.hpp"
#include "support/long_tests.hpp"

namespace scanloc::test {
namespace {

using ::testing::HasSubstr;

TEST(RosNode, TellsWhereTheRobotIsAndEnds) {
  // The sensor sits 1 m above the base and looks to its left.
  RunningNode node({"--map", Town().map1, "--once", "--T-base-sensor", "0,0,1,0,0,90"});
  const Pose T_base_sensor = Eigen::Translation3d(0, 0, 1) *
                             Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ());
  node.robot.Subscribe("/scanloc/candidates", "geometry_msgs/PoseArray");
  ASSERT_TRUE(node.robot.WaitForWriter("/scanloc/candidates"));
  node.SendScan(Town().drive2, 12, kStart_ns);
  const auto bytes = node.robot.Next("/initialpose");
  ASSERT_TRUE(bytes.has_value());
  const PoseHeard heard = ReadPoseWithCovariance(*bytes);
  EXPECT_EQ(heard.stamp_ns, kStart_ns);
  EXPECT_EQ(heard.frame, "map");
  EXPECT_TRUE((heard.pose * T_base_sensor)
                  .translation()
                  .isApprox(AnswerOfCommandLine(Town().drive2, 12), 1e-3))
      << heard.pose.translation().transpose();
  EXPECT_GT(heard.covariance[0], 0.0);
  const auto candidates = node.robot.Next("/scanloc/candidates");
  ASSERT_TRUE(candidates.has_value());
  EXPECT_TRUE(ReadPoseArray(*candidates).at(0).isApprox(heard.pose, 1e-9));
  EXPECT_EQ(node.process.Wait(), 0) << node.process.stderr_text();
}

TEST(RosNode, FindsTheRobotOfARecordedDrive) {
  const TempDir dir;
  const std::string map = dir.File("street.scanloc");
  MustScanloc({"build", map, "--bag", BagPath("drive1.mcap"), "--spacing-m", "0", "--quiet"});
  const DomainLease domain;
  const std::string number = std::to_string(domain.domain());
  Process node({BinDir() + "/scanloc-ros2", "--map", map, "--domain", number},
               {.environment = {CycloneOnLoopback()}});
  ASSERT_EQ(node.ReadLine(), "scanloc-ros2 ready");
  const ProcessResult played =
      RunProcess({BinDir() + "/../tests/ros2_play_bag", BagPath("drive2.mcap"), number});
  ASSERT_EQ(played.status, 0) << played.err;
  // truth2.txt: the sensor was at (-82.218, -29.250, 1.250) at first, headed 52.9 degrees; the base
  // is 1.2 m behind and 1.7 m below.
  EXPECT_THAT(played.out, HasSubstr("nanosec: 0}\n  frame_id: map"));
  double x_m = 0.0, y_m = 0.0, z_m = 0.0;
  ASSERT_EQ(std::sscanf(played.out.substr(played.out.find("{x:")).c_str(),
                        "{x: %lf, y: %lf, z: %lf", &x_m, &y_m, &z_m),
            3);
  EXPECT_NEAR(x_m, -82.218 - 1.2 * 0.6025, 0.3);
  EXPECT_NEAR(y_m, -29.250 - 1.2 * 0.7981, 0.3);
  EXPECT_NEAR(z_m, 1.250 - 1.7, 0.3);
  EXPECT_EQ(node.Wait(), 0) << node.stderr_text();
}

TEST(RosNode, SurvivesMessagesThatAreNone) {
  RunningNode node({"--map", Town().map1, "--always"});
  const std::string good = CloudBytes(ScanOf(Town().drive2, 3), kStart_ns);
  const std::vector<std::pair<std::string, std::string>> clouds = {
      {LyingCloudBytes({.point_step = 0}), "of the 0 bytes of a point"},
      {LyingCloudBytes({.height = 30'000, .width = 100'000}), "a scan has at most"},
      {LyingCloudBytes({.z_offset = 4'000'000'000}), "at 4000000000"},
      {LyingCloudBytes({.z_type = 99}), "has the type 99"},
      {LyingCloudBytes({.width = 1000}), "holds 16 bytes"},
  };
  for (const auto& [bytes, reason] : clouds) {
    ASSERT_TRUE(node.robot.Publish("/points", bytes));
    EXPECT_EQ(node.WaitForMessage(reason).level, 2);
  }
  // What is no message of its type at all is refused by DDS, which we hear of.
  std::string announces_3_gb = LyingCloudBytes({});
  announces_3_gb.replace(announces_3_gb.size() - 21, 4, std::string("\x00\x5e\xd0\xb2", 4));
  std::size_t num_malformed = 0;
  for (const std::string& bytes :
       {good.substr(0, 40), good.substr(0, good.size() / 2), announces_3_gb,
        std::string("\0\1\0\0", 4), std::string(2000, '\xff'), std::string("\0\1\0\0", 4) + good}) {
    ASSERT_TRUE(node.robot.Publish("/points", bytes));
    ++num_malformed;
    node.WaitForDiagnosis([&](const DiagnosisHeard& heard) {
      return std::stoul(heard.values.at("malformed_messages")) >= num_malformed;
    });
  }
  for (const std::string& bytes :
       {std::string(100, '\x7f'),
        OdometryBytes(Pose(Eigen::Translation3d(NAN, 0, 0)), kStart_ns)}) {
    ASSERT_TRUE(node.robot.Publish("/odom", bytes));
  }
  ASSERT_TRUE(node.robot.Publish("/points", good));
  EXPECT_TRUE(node.robot.Next("/initialpose").has_value());
  const DiagnosisHeard heard = node.WaitForDiagnosis(
      [](const DiagnosisHeard& diagnosis) { return diagnosis.message == "localized"; });
  EXPECT_EQ(heard.level, 0);
  EXPECT_EQ(heard.values.at("clouds_refused"), std::to_string(clouds.size()));
  node.process.Signal(SIGTERM);
  EXPECT_EQ(node.process.Wait(), 0) << node.process.stderr_text();
}

TEST(RosNode, PublishesTransformsAndBeginsAnewAtATrigger) {
  RunningNode node({"--map", Town().map1, "--publish-tf", "--trigger", "/wake_up"});
  node.robot.Subscribe("/tf", "tf2_msgs/TFMessage");
  node.robot.Advertise("/wake_up", "std_msgs/Empty");
  ASSERT_TRUE(node.robot.WaitForWriter("/tf") && node.robot.WaitForReader("/wake_up"));
  node.WaitForMessage("waits for a trigger");
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(node.robot.Publish("/wake_up", EmptyBytes()));
    node.WaitForDiagnosis(
        [](const DiagnosisHeard& heard) { return heard.values.at("state") == "searching"; });
    const std::int64_t stamp_ns = kStart_ns + i * 1'000'000'000;
    const Pose T_odom_base(Eigen::Translation3d(7.0 + i, 1.0, 0.0));
    ASSERT_TRUE(node.robot.Publish("/odom", OdometryBytes(T_odom_base, stamp_ns)));
    node.SendScan(Town().drive2, 12 + i, stamp_ns);
    const auto initial = node.robot.Next("/initialpose");
    ASSERT_TRUE(initial.has_value());
    const Pose T_map_base = ReadPoseWithCovariance(*initial).pose;
    ASSERT_TRUE(node.robot.Publish("/odom", OdometryBytes(T_odom_base, stamp_ns + 50'000'000)));
    const auto bytes = node.robot.Next("/tf");
    ASSERT_TRUE(bytes.has_value());
    const PoseHeard tf = ReadTransform(*bytes);
    EXPECT_EQ(tf.frame, "map");
    EXPECT_EQ(tf.child, "odom");
    EXPECT_EQ(tf.stamp_ns, stamp_ns + 50'000'000);
    EXPECT_TRUE((tf.pose * T_odom_base).isApprox(T_map_base, 1e-9));
  }
  node.process.Signal(SIGTERM);
  EXPECT_EQ(node.process.Wait(), 0) << node.process.stderr_text();
}

/// `scanlocd` with the map of Town().
class ServedTown {
 public:
  explicit ServedTown(const std::string& listen = "127.0.0.1:0")
      : process_({kScanlocd, "--map", "town=" + Town().map1, "--listen", listen}) {
    const std::string ready = process_.ReadLine();
    address = ready.substr(ready.rfind(' ') + 1);
  }
  std::string address;

 private:
  Process process_;
};

TEST(RosNode, AsksAServerThatComesGoesAndComesBack) {
  auto server = std::make_unique<ServedTown>();
  const std::string address = server->address;
  server.reset();  // its port is free again
  RunningNode node({"--server", address, "--always", "--interval", "0.1", "--deadline", "1"});
  std::atomic<bool> ends = false;
  std::thread driving([&] {
    for (int i = 0; !ends; ++i) {
      node.SendScan(Town().drive2, 12, kStart_ns + i * 100'000'000);
      std::this_thread::sleep_for(std::chrono::milliseconds(100));  // the sensor's pace
    }
  });
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(node.WaitForMessage("no answer: ").level, 2);
    server = std::make_unique<ServedTown>(address);
    const DiagnosisHeard heard = node.WaitForDiagnosis(
        [](const DiagnosisHeard& diagnosis) { return diagnosis.message == "localized"; });
    EXPECT_EQ(heard.values.at("map"), "town");
    server.reset();
  }
  ends = true;
  driving.join();
  EXPECT_TRUE(node.robot.Next("/initialpose").has_value());
}

TEST(RosNode, EndsAtOnceWhileAQuestionIsUnderWay) {
  SilentServer server;
  RunningNode node({"--server", server.address(), "--always", "--deadline", "60"});
  node.SendScan(Town().drive2, 12, kStart_ns);
  node.WaitForDiagnosis(
      [](const DiagnosisHeard& heard) { return heard.values.at("clouds_asked") == "1"; });
  const auto before = std::chrono::steady_clock::now();
  node.process.Signal(SIGTERM);
  EXPECT_EQ(node.process.Wait(), 0) << node.process.stderr_text();
  EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::seconds(1));
}

TEST(RosNode, LosesNoneOfLargeCloudsAtTheSensorsPace) {
  const int num_clouds = LongTests() ? 600 : 30;
  // Where the kernel gives small buffers only, nothing but sending again helps.
  const bool is_reliable = ros2::LargestReceiveBuffer_bytes() < 4'000'000;
  RunningNode node(
      {"--map", Town().map1, "--always", "--reliability", is_reliable ? "reliable" : "best_effort"},
      is_reliable ? RosPeer::Reliability::kReliable : RosPeer::Reliability::kBestEffort);
  PointCloud points = ScanOf(Town().drive2, 12);
  points.resize(131'072);  // the rest at the sensor, as returns that are none
  for (int i = 0; i < num_clouds; ++i) {
    ASSERT_TRUE(node.robot.Publish(
        "/points", CloudBytes(points, kStart_ns + static_cast<std::int64_t>(i) * 100'000'000)));
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // the sensor's pace
  }
  const DiagnosisHeard heard = node.WaitForDiagnosis([&](const DiagnosisHeard& diagnosis) {
    return std::stoi(diagnosis.values.at("clouds_received")) >= num_clouds;
  });
  EXPECT_EQ(heard.values.at("clouds_received"), std::to_string(num_clouds));
  EXPECT_EQ(heard.values.at("clouds_refused"), "0");
  EXPECT_EQ(heard.values.at("state"), "localized");
}

TEST(RosNode, NeedsNoTopicForTheInitialPose) {
  const DomainLease domain;
  Process node({BinDir() + "/scanloc-ros2", "--map", Town().map1, "--always", "--initialpose", "",
                "--domain", std::to_string(domain.domain())},
               {.environment = {CycloneOnLoopback()}});
  EXPECT_EQ(node.ReadLine(), "scanloc-ros2 ready");
  node.Signal(SIGTERM);
  EXPECT_EQ(node.Wait(), 0) << node.stderr_text();
}

TEST(RosNode, SaysWhyNoCloudsCome) {
  RunningNode node({"--map", Town().map1, "--points", "/lidar"});
  // Before the robot's topics are discovered nobody publishes any.
  EXPECT_THAT(node.WaitForMessage("there are clouds").message,
              HasSubstr("nobody publishes clouds on /lidar; there are clouds on /points"));
  node.robot.Advertise("/lidar", "livox_ros_driver2/CustomMsg");
  EXPECT_THAT(node.WaitForMessage("is of type").message,
              HasSubstr("/lidar is of type livox_ros_driver2::msg::dds_::CustomMsg_; only "
                        "sensor_msgs/PointCloud2 is read"));
}

TEST(RosNode, FindsATopicAmongHundredsThatAreGone) {
  RunningNode node({"--map", Town().map1, "--points", "/lidar", "--publish-tf"});
  {
    RosPeer others(node.domain.domain());
    for (int i = 0; i < 300; ++i) {
      others.Advertise("/other" + std::to_string(i), "std_msgs/Empty");
    }
    others.Subscribe("/tf", "tf2_msgs/TFMessage");
    ASSERT_TRUE(others.WaitForWriter("/tf"));
    node.WaitForMessage("nobody publishes clouds on /lidar");
  }
  node.robot.Advertise("/lidar", "livox_ros_driver2/CustomMsg");
  node.WaitForMessage("/lidar is of type");
}

TEST(RosNode, SaysWhatItCannotHear) {
  RunningNode node({"--map", Town().map1, "--trigger", "/wake_up", "--tf-static", "/mounts"});
  node.robot.Advertise("/wake_up", "std_msgs/Empty", RosPeer::Reliability::kBestEffort);
  node.WaitForMessage("a publisher of /wake_up is best effort and not heard");
  node.robot.Advertise("/mounts", "tf2_msgs/TFMessage", RosPeer::Reliability::kReliable,
                       RosPeer::Durability::kVolatile);
  const DiagnosisHeard heard = node.WaitForMessage("a publisher of /mounts");
  EXPECT_THAT(heard.message, HasSubstr("/mounts is volatile, not transient local, and not heard"));
  EXPECT_EQ(heard.level, 1);
  RosPeer other(node.domain.domain());
  other.Advertise("/odom", "nav_msgs/Odometry");
  node.WaitForMessage("2 publish odometry on /odom");
  RosPeer third(node.domain.domain());
  third.Advertise("/odom", "geometry_msgs/TwistStamped");
  node.WaitForMessage("only nav_msgs/Odometry is read");
}

TEST(RosNode, SaysThatALateSubscriberAsksForWhatItDoesNotKeep) {
  RunningNode node({"--map", Town().map1, "--initialpose", "/start"});
  node.robot.Subscribe("/start", "geometry_msgs/PoseWithCovarianceStamped",
                       RosPeer::Durability::kTransientLocal);
  node.WaitForMessage("a subscriber of /start wants transient local and hears nothing");
}

TEST(RosNode, RefusesWrongUsage) {
  const std::string program = BinDir() + "/scanloc-ros2";
  for (const auto& [args, reason] : std::vector<std::pair<Args, std::string>>{
           {{}, "--server HOST:PORT or --map FILE"},
           {{"--map", "m", "--server", "h:1"}, "excludes"},
           {{"--map", "m", "--once", "--always"}, "excludes"},
           {{"--map", "m", "--domain", "400"}, "400"},
           {{"--server", "h:1", "--token-file", ""}, "--token-file: its value is empty"},
           {{"--map", "m", "--T-base-sensor", "1,2,3"}, "--T-base-sensor"},
           {{"--map", "m", "--T-base-sensor", "1,2,nan,0,0,0"}, "nan"},
           {{"--map", Town().map1, "--points", "a b"}, "is no name of a topic"},
           {{"--map", "m", "--points", ""}, "--points: its value is empty"},
           {{"--map", "m", "--map-frame", ""}, "--map-frame: its value is empty"},
           {{"--map", "m", "--base-frame", ""}, "--base-frame: its value is empty"},
           {{"--map", "m", "--initialpose", ""}, "--until-localized needs --initialpose"},
           {{"--map", "m", "--publish-tf", "--odom", ""}, "needs --odom"}}) {
    const ProcessResult result = RunProcess(Command(program, args));
    EXPECT_EQ(result.status, 2) << reason;
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr(reason));
  }
  const ProcessResult none = RunProcess({program, "--map", "/no/such.scanloc"});
  EXPECT_EQ(none.status, 1);
  EXPECT_THAT(none.err, HasSubstr("/no/such.scanloc"));
}

}  // namespace
}  // namespace scanloc::test
