// Messages of ROS by their bytes, transforms and motion.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "bag/decompress.hpp"
#include "bag/point_field.hpp"
#include "scanloc/dataset/bag_drive.hpp"
#include "scanloc/dataset/deskew.hpp"
#include "scanloc/dataset/frame_tree.hpp"
#include "scanloc/dataset/ros_messages.hpp"
#include "support/scan_files.hpp"

namespace scanloc::dataset {
namespace {

using test::AppendBytes;
using ::testing::ElementsAre;
using ::testing::FloatNear;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// A message of ROS 1, which packs its values.
class Ros1Message {
 public:
  template <typename Number>
  Ros1Message& Add(Number value) {
    AppendBytes(bytes_, value);
    return *this;
  }
  Ros1Message& Add(const std::string& text) {
    AppendBytes(bytes_, static_cast<std::uint32_t>(text.size()));
    bytes_ += text;
    return *this;
  }
  Ros1Message& Head(std::uint32_t seconds, const std::string& frame) {
    return Add(std::uint32_t{0}).Add(seconds).Add(std::uint32_t{5}).Add(frame);
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

struct Layout {
  std::uint32_t height = 1, width = 1, z_offset = 8, point_step = 12, row_step = 12, num_data = 12;
  std::uint8_t z_type = 7;
  std::uint32_t z_count = 1;
};

std::string Cloud(const Layout& layout) {
  Ros1Message message;
  message.Head(1, "/lidar").Add(layout.height).Add(layout.width).Add(std::uint32_t{3});
  message.Add(std::string("x")).Add(std::uint32_t{0}).Add(std::uint8_t{7}).Add(std::uint32_t{1});
  message.Add(std::string("y")).Add(std::uint32_t{4}).Add(std::uint8_t{7}).Add(std::uint32_t{1});
  message.Add(std::string("z")).Add(layout.z_offset).Add(layout.z_type).Add(layout.z_count);
  message.Add(std::uint8_t{0}).Add(layout.point_step).Add(layout.row_step);
  message.Add(layout.num_data).Add(1.0F).Add(2.0F).Add(3.0F).Add(std::uint8_t{1});
  return message.bytes();
}

TEST(CloudMessage, IsReadWhole) {
  const std::string bytes = Cloud({});
  const auto cloud = DecodeCloud(WireFormat::kRos1, bytes, true);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->head.stamp_ns, 1'000'000'005);
  EXPECT_EQ(cloud->head.frame, "lidar");
  EXPECT_EQ(cloud->scan.points, (PointCloud{{1, 2, 3}}));
  for (std::size_t size = 0; size + 1 < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeCloud(WireFormat::kRos1, bytes.substr(0, size), true).ok()) << size;
  }
}

TEST(CloudMessage, IsRefusedWithTheReason) {
  for (const auto& [layout, reason] : std::vector<std::pair<Layout, std::string>>{
           {{.height = 30000, .width = 100000},
            "100000 x 30000 points; a scan has at most 4000000"},
           {{.width = 2}, "holds 12 bytes"},
           {{.height = 2, .row_step = 0}, "0 bytes a row"},
           {{.height = 2, .row_step = 4'000'000'000U}, "4000000000 bytes a row"},
           {{.z_offset = 9}, "field \"z\" of the cloud has the type 7 at 9"},
           {{.z_offset = 4'294'967'295U}, "at 4294967295"},
           {{.z_type = 9}, "has the type 9"},
           {{.z_type = 4}, "no field z of FLOAT32 or FLOAT64"},
           {{.point_step = 0}, "of the 0 bytes of a point"},
           {{.num_data = 3'000'000'000U}, "not whole"}}) {
    const auto cloud = DecodeCloud(WireFormat::kRos1, Cloud(layout), false);
    EXPECT_EQ(cloud.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(cloud.status().message()), HasSubstr(reason));
  }
  EXPECT_FALSE(DecodeCloud(WireFormat::kCdr, Cloud({}), false).ok());
  EXPECT_FALSE(DecodeCloud(WireFormat::kCdr, std::string("\0\x03\0\0", 4), false).ok());
  EXPECT_FALSE(DecodeCloud(WireFormat::kOther, Cloud({}), false).ok());
}

TEST(CloudMessage, MaySayThatItHasNoneOfACoordinate) {
  const auto cloud = DecodeCloud(WireFormat::kRos1, Cloud({.z_count = 0}), false);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->scan.points, (PointCloud{{1, 2, 3}}));
}

TEST(CloudMessage, MayBeWithoutPointsAndFields) {
  Ros1Message message;
  message.Head(1, "/lidar").Add(std::uint64_t{0}).Add(std::uint32_t{0});  // height, width, fields
  message.Add(std::uint8_t{0}).Add(std::uint64_t{0}).Add(std::uint32_t{0}).Add(std::uint8_t{1});
  const auto cloud = DecodeCloud(WireFormat::kRos1, message.bytes(), true);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_THAT(cloud->scan.points, IsEmpty());
}

TEST(CloudMessage, TellsTheUnitOfTimesAndWhetherTheyAreAbsolute) {
  constexpr std::int64_t kStamp_ns = 1'700'000'000'000'000'000;
  EXPECT_THAT(OffsetsFromStamp({-0.05, 0.0, 0.05}, kStamp_ns), ElementsAre(-0.05F, 0.0F, 0.05F));
  EXPECT_THAT(OffsetsFromStamp({0.0, 100'000.0}, kStamp_ns), ElementsAre(0.0F, 0.1F));
  EXPECT_THAT(OffsetsFromStamp({0.0, 99'000'000.0}, kStamp_ns), ElementsAre(0.0F, 0.099F));
  EXPECT_THAT(OffsetsFromStamp({0.0, 100.0}, kStamp_ns), ElementsAre(0.0F, 0.1F));
  EXPECT_THAT(OffsetsFromStamp({1.7e9, 1.7e9 + 0.1}, kStamp_ns),
              ElementsAre(0.0F, FloatNear(0.1F, 1e-6F)));
  EXPECT_THAT(OffsetsFromStamp({1.7e18, 1.7e18 + 1e8}, kStamp_ns),
              ElementsAre(FloatNear(0.0F, 1e-6F), FloatNear(0.1F, 1e-6F)));
  EXPECT_THAT(OffsetsFromStamp({kNoTime, 1.7e9, kNoTime, 1.7e9 + 0.1}, kStamp_ns),
              ElementsAre(0.0F, 0.0F, 0.0F, FloatNear(0.1F, 1e-6F)));
  EXPECT_THAT(OffsetsFromStamp({kNoTime}, kStamp_ns), IsEmpty());
  EXPECT_THAT(OffsetsFromStamp({0.0, 1.7e9, 1.7e9 + 0.1}, kStamp_ns), IsEmpty())
      << "no sweep of 1.7 s in nanoseconds";
  // No sweep, no number, another day.
  EXPECT_THAT(OffsetsFromStamp({}, kStamp_ns), IsEmpty());
  EXPECT_THAT(OffsetsFromStamp({7.0, 7.0}, kStamp_ns), IsEmpty());
  EXPECT_THAT(OffsetsFromStamp({0.0, NAN}, kStamp_ns), IsEmpty());
  EXPECT_THAT(OffsetsFromStamp({1.5e9, 1.5e9 + 0.1}, kStamp_ns), IsEmpty());
}

TEST(CloudMessage, HasNoTimesOfBeamsWithoutAReturn) {
  std::string bytes;
  for (const auto& [x, time] : {std::pair(0.0F, 0.0), {20.0F, 1.7e9}, {NAN, 0.0}, {0.0F, 5.0}}) {
    for (const float coordinate : {x, 0.0F, 0.0F}) AppendBytes(bytes, coordinate);
    AppendBytes(bytes, time);
  }
  BinaryLayout xyz;
  for (std::size_t axis = 0; axis < 3; ++axis) xyz.xyz[axis] = {4 * axis, 20, NumberType::kFloat32};
  std::vector<double> values;
  AppendTimes({.name = "timestamp", .offset = 12, .type = 8}, xyz, 4, bytes, values);
  EXPECT_THAT(values, ElementsAre(kNoTime, 1.7e9, kNoTime));
}

TEST(CloudMessage, HasNoTimesOfAnotherClockThanItsStamp) {
  constexpr std::int64_t kStamp_ns = 1'700'000'000'000'000'000;
  for (const double late_s : {-37.0, -0.5, 0.5, 37.0, 3600.0}) {
    const double first_s = 1.7e9 + late_s;
    EXPECT_THAT(OffsetsFromStamp({first_s, first_s + 0.1}, kStamp_ns), IsEmpty()) << late_s;
    EXPECT_THAT(OffsetsFromStamp({1e9 * first_s, 1e9 * (first_s + 0.1)}, kStamp_ns), IsEmpty());
  }
  EXPECT_THAT(OffsetsFromStamp({0.6, 0.7}, kStamp_ns), IsEmpty()) << "since the last full second";
  EXPECT_THAT(OffsetsFromStamp({-0.3, -0.2}, kStamp_ns), SizeIs(2)) << "stamped on arrival";
}

TEST(PoseMessages, LeaveOutWhatIsNoPose) {
  Ros1Message message;
  message.Add(std::uint32_t{2});
  for (const double w : {1.0, 0.0}) {
    message.Head(3, "/map").Add(std::string("base"));
    for (const double value : {1.0, 2.0, 3.0, 0.0, 0.0, 0.0, w}) message.Add(value);
  }
  std::size_t num_bad = 0;
  const auto poses = DecodePoses("tf/tfMessage", WireFormat::kRos1, message.bytes(), num_bad);
  ASSERT_TRUE(poses.ok()) << poses.status();
  ASSERT_EQ(poses->size(), 1U);
  EXPECT_EQ(num_bad, 1U);
  EXPECT_EQ(poses->front().parent, "map");
  EXPECT_EQ(poses->front().child, "base");
  for (std::size_t size = 0; size < message.bytes().size(); ++size) {
    EXPECT_FALSE(
        DecodePoses("tf/tfMessage", WireFormat::kRos1, message.bytes().substr(0, size), num_bad)
            .ok());
  }
}

Pose At(double x, double yaw_rad = 0.0) {
  return Eigen::Translation3d(x, 0, 0) * Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ());
}

TEST(FrameTree, ConnectsFramesUpAndDownAndInterpolates) {
  FrameTree tree;
  tree.Add({0, "map", "odom", At(100)}, true);
  tree.Add({1'000, "odom", "base", At(2, 0.4)}, false);
  tree.Add({0, "odom", "base", At(1, 0.2)}, false);
  tree.Add({0, "base", "lidar", At(0.5)}, true);
  tree.Add({0, "base", "camera", At(3)}, true);
  tree.Sort();
  const auto lidar = tree.Connect("map", "lidar");
  ASSERT_TRUE(lidar.ok()) << lidar.status();
  const std::optional<Pose> between = lidar->At(500);
  ASSERT_TRUE(between.has_value());
  EXPECT_TRUE(between->isApprox(At(101.5, 0.3) * At(0.5), 1e-9)) << between->matrix();
  EXPECT_FALSE(lidar->At(-1).has_value());
  EXPECT_FALSE(lidar->At(1'001).has_value());
  const auto sideways = tree.Connect("camera", "lidar");
  ASSERT_TRUE(sideways.ok());
  EXPECT_TRUE(sideways->At(7)->isApprox(At(-2.5), 1e-12)) << "static frames need no time";
}

TEST(FrameTree, DoesNotInterpolateOverAGap) {
  FrameTree tree;
  tree.Add({0, "odom", "lidar", At(0)}, false);
  tree.Add({kMaxPoseGap_ns + 1, "odom", "lidar", At(1)}, false);
  tree.Sort();
  EXPECT_FALSE(tree.Connect("odom", "lidar")->At(1'000).has_value());
  EXPECT_TRUE(tree.Connect("odom", "lidar")->At(0).has_value());
}

TEST(PoseTrack, SaysNothingWherePosesContradictEachOther) {
  constexpr std::int64_t kStep_ns = 50'000'000;
  for (const auto& [what, offset_m, num] : std::vector<std::tuple<std::string, double, int>>{
           {"two that agree", 0.2, 0}, {"two that do not", 1.5, 38}}) {
    PoseTrack track;
    for (int i = 0; i < 20; ++i) {
      track.Add(i * kStep_ns, At(0.5 * i));
      track.Add(i * kStep_ns, At(0.5 * i + offset_m));
    }
    track.Sort();
    EXPECT_EQ(track.NumContradicted(), num) << what;
    for (const std::int64_t stamp_ns : {10 * kStep_ns, 10 * kStep_ns + 7}) {
      EXPECT_EQ(track.At(stamp_ns).has_value(), num == 0) << what;
    }
  }
  PoseTrack corrected;  // once
  for (int i = 0; i < 20; ++i) corrected.Add(i * kStep_ns, At(i < 10 ? 0.1 * i : 0.1 * i - 3));
  corrected.Sort();
  EXPECT_EQ(corrected.NumContradicted(), 2U);
  EXPECT_FALSE(corrected.At(9 * kStep_ns + 1).has_value()) << "was never between";
  EXPECT_NEAR(corrected.At(7 * kStep_ns)->translation().x(), 0.7, 1e-9);
  EXPECT_NEAR(corrected.At(12 * kStep_ns)->translation().x(), -1.8, 1e-9);
  PoseTrack turning;  // at 1 rad/s from one pose to the next
  for (int i = 0; i < 20; ++i) turning.Add(i * 5 * kStep_ns, At(1.0, 0.25 * std::max(0, i - 9)));
  turning.Sort();
  EXPECT_EQ(turning.NumContradicted(), 0U);
}

TEST(PoseTrack, ForgetsWhatCameBefore) {
  PoseTrack track;
  for (const std::int64_t stamp_ns : {10, 20, 30}) track.Add(stamp_ns, At(1));
  track.ForgetBefore(20);
  EXPECT_FALSE(track.At(15).has_value());
  EXPECT_TRUE(track.At(20).has_value());
  track.ForgetBefore(40);
  EXPECT_FALSE(track.At(30).has_value());
}

TEST(FrameTree, RefusesWhatIsNoTreeOnTheWayOnly) {
  FrameTree tree;
  tree.Add({0, "a", "b", At(1)}, true);
  tree.Add({0, "a", "camera", At(0)}, true);
  tree.Add({0, "mast", "camera", At(0)}, true);
  tree.Add({0, "self", "self", At(0)}, true);
  EXPECT_TRUE(tree.Connect("a", "b").ok());
  for (const auto& [parent, child] : {std::pair("a", "camera"), {"camera", "b"}}) {
    EXPECT_THAT(std::string(tree.Connect(parent, child).status().message()),
                HasSubstr("frame \"camera\" has two parents, \"a\" and \"mast\""));
  }
  EXPECT_FALSE(tree.Connect("a", "self").ok());
  tree.Add({0, "b", "b", At(0)}, true);
  EXPECT_TRUE(tree.Connect("a", "b").ok());
  tree.Add({0, "b", "a", At(0)}, true);
  EXPECT_THAT(std::string(tree.Connect("map", "a").status().message()),
              HasSubstr("no transforms connect frame \"a\" to \"map\""))
      << "a circle ends";
  EXPECT_THAT(std::string(tree.Connect("a", "b").status().message()),
              HasSubstr("go in a circle: \"b\" lies in \"a\" lies in \"b\""));
}

TEST(FrameTree, TellsWhichFramesWereSaidToBeElsewhere) {
  FrameTree tree;
  tree.Add({0, "base", "lidar", At(1)}, true);
  tree.Add({0, "base", "lidar", At(1.05)}, true);
  tree.Add({0, "base", "wheel", At(1)}, false);
  tree.Add({1, "base", "wheel", At(5)}, false);
  EXPECT_THAT(tree.moved(), IsEmpty());
  tree.Add({0, "base", "lidar", At(3)}, true);
  EXPECT_THAT(tree.moved(), ElementsAre("lidar"));
}

TEST(Deskew, MovesPointsToWhereTheyWouldBeSeenAtTheStamp) {
  const PoseAt drive = [](std::int64_t stamp_ns) {
    return std::optional(At(10.0 * 1e-9 * static_cast<double>(stamp_ns)));
  };
  PointCloud points = {{5, 0, 0}, {5, 0, 0}, {5, 0, 0}};
  ASSERT_TRUE(Deskew(drive, 1'000'000'000, {-0.05F, 0.0F, 0.05F}, points));
  EXPECT_NEAR(points[0].x, 4.5F, 0.01F);
  EXPECT_NEAR(points[1].x, 5.0F, 0.01F);
  EXPECT_NEAR(points[2].x, 5.5F, 0.01F);
  const PoseAt unknown = [](std::int64_t) { return std::optional<Pose>(); };
  EXPECT_FALSE(Deskew(unknown, 0, {0.0F, 0.1F, 0.2F}, points));
}

TEST(Decompress, RefusesMoreOrFewerBytesThanAnnounced) {
  // "abc" as a zstd frame without a checksum.
  const std::string frame(
      "\x28\xB5\x2F\xFD\x20\x03\x19\x00\x00"
      "abc",
      12);
  const auto whole = Decompress(Compression::kZstd, frame, 3);
  ASSERT_TRUE(whole.ok()) << whole.status();
  EXPECT_EQ(whole->view(), "abc");
  EXPECT_FALSE(Decompress(Compression::kZstd, frame, 2).ok());
  EXPECT_FALSE(Decompress(Compression::kZstd, frame, 4).ok());
  EXPECT_TRUE(Decompress(Compression::kZstd, frame, 4, CutOff::kAnySize).ok());
  EXPECT_FALSE(Decompress(Compression::kZstd, frame.substr(0, 10), 4, CutOff::kAnySize).ok());
  EXPECT_FALSE(DecompressZstd(frame, 2).ok());
  for (const Compression kind : {Compression::kZstd, Compression::kLz4, Compression::kBz2}) {
    EXPECT_FALSE(Decompress(kind, "no frame at all", 100).ok());
    EXPECT_EQ(Decompress(kind, "no frame at all", 100, CutOff::kKeepWhatCame)->view(), "");
    EXPECT_FALSE(Decompress(kind, "", 100).ok());
  }
}

}  // namespace
}  // namespace scanloc::dataset
