// The intensities of scans in every format that has them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "absl/strings/str_cat.h"
#include "scan_decoders.hpp"
#include "scanloc/dataset/bag_drive.hpp"
#include "scanloc/dataset/ros_messages.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "support/paths.hpp"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::AppendBytes;
using test::AppendBytesBigEndian;
using test::TempDir;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

void ExpectIntensities(const absl::StatusOr<Scan>& scan, const std::vector<float>& expected) {
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points.size(), expected.size());
  EXPECT_EQ(scan->intensities, expected);
}

TEST(Intensities, OfKittiStayWithTheirPoints) {
  std::string bytes;
  for (const auto& row :
       {std::array{1.0F, 2.0F, 3.0F, 0.25F}, std::array{kNaN, 2.0F, 3.0F, 0.5F},
        std::array{1.0F, 2.0F, 4.0F, kNaN}, std::array{1.0F, 2.0F, 6.0F, 0.75F}}) {
    for (const float value : row) AppendBytes(bytes, value);
  }
  ExpectIntensities(DecodeKittiBin(bytes, true), {0.25F, 0.0F, 0.75F});
  EXPECT_THAT(DecodeKittiBin(bytes, false)->intensities, IsEmpty()) << "nobody asked";
}

std::string PcdHead(const std::string& name, char type, int size, const std::string& data) {
  return absl::StrCat("VERSION .7\nFIELDS ring ", name, " x y z\nSIZE 1 ", size, " 4 4 4\nTYPE U ",
                      std::string(1, type),
                      " F F F\nCOUNT 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ", data, "\n");
}

template <typename Number>
void ExpectInPcd(char type) {
  SCOPED_TRACE(absl::StrCat(std::string(1, type), sizeof(Number)));
  const std::vector<Point> points = {{1, 2, 3}, {4, 5, 6}};
  std::string rows, fields(2, '\7');
  for (const Number value : {Number{3}, Number{100}}) AppendBytes(fields, value);
  for (const auto axis : {&Point::x, &Point::y, &Point::z}) {
    for (const Point& p : points) AppendBytes(fields, p.*axis);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    rows += '\7';
    AppendBytes(rows, i == 0 ? Number{3} : Number{100});
    for (const float value : {points[i].x, points[i].y, points[i].z}) AppendBytes(rows, value);
  }
  std::string packed;  // LZF: literal runs of at most 32 bytes
  for (std::size_t at = 0; at < fields.size(); at += 32) {
    const std::string run = fields.substr(at, 32);
    packed += static_cast<char>(run.size() - 1) + run;
  }
  std::string sizes;
  AppendBytes(sizes, static_cast<std::uint32_t>(packed.size()));
  AppendBytes(sizes, static_cast<std::uint32_t>(fields.size()));
  const auto head = [&](const std::string& data) {
    return PcdHead("intensity", type, static_cast<int>(sizeof(Number)), data);
  };
  for (const std::string& pcd : {head("binary") + rows, head("binary_compressed") + sizes + packed,
                                 head("ascii") + "7 3 1 2 3\n7 100 4 5 6\n"}) {
    ExpectIntensities(DecodePcd(pcd, true), {3.0F, 100.0F});
  }
}

TEST(Intensities, OfPcdAreOfAnyType) {
  ExpectInPcd<float>('F');
  ExpectInPcd<double>('F');
  ExpectInPcd<std::uint8_t>('U');
  ExpectInPcd<std::uint16_t>('U');
  ExpectInPcd<std::uint32_t>('U');
  ExpectInPcd<std::int8_t>('I');
  ExpectInPcd<std::int16_t>('I');
  ExpectInPcd<std::int32_t>('I');
}

TEST(Intensities, OfPcdAreKnownByTheirNames) {
  for (const char* name : {"intensity", "reflectivity", "reflectance"}) {
    ExpectIntensities(DecodePcd(PcdHead(name, 'F', 4, "ascii") + "7 3 1 2 3\n7 9 4 5 6\n", true),
                      {3.0F, 9.0F});
  }
  ExpectIntensities(
      DecodePcd(PcdHead("intensity", 'F', 4, "ascii") + "7 -3 1 2 3\n7 inf 4 5 6\n", true),
      {0.0F, 0.0F});
  const auto other = DecodePcd(PcdHead("rgb", 'F', 4, "ascii") + "7 3 1 2 3\n7 9 4 5 6\n", true);
  EXPECT_THAT(other->intensities, IsEmpty());
  const auto word =
      DecodePcd(PcdHead("intensity", 'F', 4, "ascii") + "7 a 1 2 3\n7 9 4 5 6\n", true);
  EXPECT_THAT(std::string(word.status().message()), HasSubstr("\"a\" is not a number"));
}

TEST(Intensities, OfPlyAreReadInBothByteOrdersAndText) {
  const auto head = [](const std::string& format) {
    return "ply\nformat " + format +
           " 1.0\nelement vertex 2\nproperty ushort reflectivity\nproperty float x\n"
           "property float y\nproperty float z\nend_header\n";
  };
  std::string little = head("binary_little_endian"), big = head("binary_big_endian");
  for (const std::uint16_t value : {std::uint16_t{300}, std::uint16_t{2}}) {
    AppendBytes(little, value);
    AppendBytesBigEndian(big, value);
    for (const float coordinate : {1.0F, 2.0F, 3.0F}) {
      AppendBytes(little, coordinate);
      AppendBytesBigEndian(big, coordinate);
    }
  }
  for (const std::string& ply : {little, big, head("ascii") + "300 1 2 3\n2 1 2 3\n"}) {
    ExpectIntensities(DecodePly(ply, true), {300.0F, 2.0F});
    EXPECT_THAT(DecodePly(ply, false)->intensities, IsEmpty());
  }
}

TEST(Intensities, OfNcltAndOxfordAreReadFromTheirLayouts) {
  ExpectIntensities(DecodeNcltSync(std::string("\x20\x4e\x20\x4e\x20\x4e\xf0\x05", 8), true),
                    {240.0F});
  std::string oxford;
  for (const float value : {1.0F, 4.0F, 2.0F, 5.0F, 3.0F, 6.0F, 20.0F, 30.0F}) {
    AppendBytes(oxford, value);
  }
  ExpectIntensities(DecodeOxford(oxford, true, true), {20.0F, 30.0F});
}

TEST(Intensities, OfBagsAreReadWithTheCloud) {
  std::vector<std::string> notes;
  const auto scans =
      ListBagScans({.paths = {test::SourceDir() + "/tests/data/bags/plain.mcap"}}, notes);
  ASSERT_TRUE(scans.ok()) << scans.status();
  const auto with = ReadScanWithIntensities(scans->front());
  ASSERT_TRUE(with.ok()) << with.status();
  EXPECT_EQ(with->intensities.size(), with->points.size());
  const auto without = ReadScan(scans->front());
  EXPECT_EQ(without->points, with->points);
  EXPECT_THAT(without->intensities, IsEmpty());
}

/// sensor_msgs/PointCloud2 of ROS 1: two points, one not finite, of x y z and a reflectivity.
std::string Cloud(std::uint8_t type, std::uint32_t width) {
  std::string bytes;
  const auto add = [&](auto... values) { (AppendBytes(bytes, values), ...); };
  const auto text = [&](const std::string& name) {
    add(static_cast<std::uint32_t>(name.size()));
    bytes += name;
  };
  add(std::uint32_t{0}, std::uint32_t{1}, std::uint32_t{0});
  text("lidar");
  add(std::uint32_t{1}, width, std::uint32_t{4});
  for (const char* axis : {"x", "y", "z"}) {
    text(axis);
    add(static_cast<std::uint32_t>(4 * (*axis - 'x')), std::uint8_t{7}, std::uint32_t{1});
  }
  text("reflectivity");
  add(std::uint32_t{12}, type, std::uint32_t{1});
  add(std::uint8_t{0}, std::uint32_t{14}, std::uint32_t{28}, std::uint32_t{28});
  for (const float x : {kNaN, 1.0F}) {
    add(x, 2.0F, 3.0F, static_cast<std::uint16_t>(x == 1.0F ? 500 : 9));
  }
  add(std::uint8_t{1});
  return bytes;
}

TEST(Intensities, OfCloudsAreOfTheTypeThatTheirFieldSays) {
  constexpr std::uint8_t kUint16 = 4, kUint8 = 2, kUnknown = 99;
  const auto read = [](std::uint8_t type, std::uint32_t width, bool with_intensities) {
    auto cloud = DecodeCloud(WireFormat::kRos1, Cloud(type, width), false, with_intensities);
    return cloud.ok() ? absl::StatusOr<Scan>(std::move(cloud->scan)) : cloud.status();
  };
  ExpectIntensities(read(kUint16, 2, true), {500.0F});
  ExpectIntensities(read(kUint8, 2, true), {static_cast<float>(500 % 256)});
  EXPECT_TRUE(read(kUnknown, 2, false).ok()) << "nobody asked";
  EXPECT_FALSE(read(kUnknown, 2, true).ok());
  EXPECT_TRUE(read(kUnknown, 0, true).ok()) << "of no points";
}

TEST(Intensities, AreMissedWithAReason) {
  const TempDir dir;
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n1 2 3\n";
  for (const std::string& path :
       {dir.Write("a.ply", ply), dir.Write("a.npy", test::NaverBytes({{1, 2, 3}}))}) {
    ASSERT_TRUE(ReadScan(path).ok());
    const auto scan = ReadScanWithIntensities({.path = path});
    EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(scan.status().message()),
                HasSubstr(path + ": its points have no intensities"));
  }
}

}  // namespace
}  // namespace scanloc::dataset
