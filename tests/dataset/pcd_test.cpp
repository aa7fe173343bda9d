#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <cmath>
#include <filesystem>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "scanloc/dataset/scan_reader.hpp"
#include "support/real_data.hpp"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::AppendBytes;
using test::RealData;
using test::SomePoints;
using test::TempDir;
using ::testing::HasSubstr;

const std::string kXyz = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n";

std::string Counts(std::size_t width, std::size_t height, std::size_t points) {
  return absl::StrCat("WIDTH ", width, "\nHEIGHT ", height, "\nPOINTS ", points, "\n");
}

std::string AsciiPcd(const std::string& rows, std::size_t num_points) {
  return absl::StrCat("VERSION 0.7\n", kXyz, Counts(num_points, 1, num_points), "DATA ascii\n",
                      rows);
}

absl::StatusOr<Scan> ReadPcd(const std::string& content) {
  const TempDir dir;
  return ReadScan(dir.Write("scan.pcd", content));
}

pcl::PointCloud<pcl::PointXYZI> ToPcl(const PointCloud& points) {
  pcl::PointCloud<pcl::PointXYZI> cloud;
  for (const Point& p : points) {
    pcl::PointXYZI point;
    point.x = p.x;
    point.y = p.y;
    point.z = p.z;
    point.intensity = 0.5F;
    cloud.push_back(point);
  }
  return cloud;
}

TEST(Pcd, ReadsWhatPclWritesInEveryEncoding) {
  const TempDir dir;
  const PointCloud points = SomePoints(500);
  const pcl::PointCloud<pcl::PointXYZI> cloud = ToPcl(points);
  pcl::PCDWriter writer;
  ASSERT_EQ(writer.writeASCII(dir.File("ascii.pcd"), cloud), 0);
  ASSERT_EQ(writer.writeBinary(dir.File("binary.pcd"), cloud), 0);
  ASSERT_EQ(writer.writeBinaryCompressed(dir.File("compressed.pcd"), cloud), 0);
  for (const char* name : {"ascii.pcd", "binary.pcd", "compressed.pcd"}) {
    const absl::StatusOr<Scan> scan = ReadScan(dir.File(name));
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->points, points) << name;
  }
}

// What PCL itself makes of a file, without the points that are not finite.
Scan ReadWithPcl(const std::string& path) {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  Scan scan;
  if (pcl::PCDReader().read(path, cloud) != 0) return scan;
  for (const pcl::PointXYZ& p : cloud) {
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) {
      scan.points.push_back({p.x, p.y, p.z});
    } else {
      ++scan.num_not_finite;
    }
  }
  return scan;
}

// It has points, but its header says WIDTH 0 and HEIGHT 0.
constexpr std::string_view kRefusedByPcl = "width-zero-compressed.pcd";

TEST(PcdOnRealData, ReadsExactlyWhatPclReads) {
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  bool any = false;
  for (const char* folder : {"formats", "kitti-00-full-scans", "mulran-kaist03-21/Scans"}) {
    const std::string path = RealData(folder);
    if (path.empty()) continue;
    for (const auto& entry : std::filesystem::directory_iterator(path)) {
      if (entry.path().extension() != ".pcd") continue;
      any = true;
      const absl::StatusOr<Scan> scan = ReadScan(entry.path().string());
      ASSERT_TRUE(scan.ok()) << scan.status();
      if (entry.path().filename() == kRefusedByPcl) continue;
      EXPECT_TRUE(*scan == ReadWithPcl(entry.path().string())) << entry.path();
    }
  }
  if (!any) GTEST_SKIP() << "no real data under " << test::RealDataRoot();
}

TEST(Pcd, UsesPointsWhereWidthOrHeightIsZero) {
  const std::string rows = "1 2 3\n4 5 6\n";
  for (const auto& [width, height] : {std::pair{0, 0}, {0, 1}, {2, 0}}) {
    const absl::StatusOr<Scan> scan =
        ReadPcd(absl::StrCat(kXyz, Counts(width, height, 2), "DATA ascii\n", rows));
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->points, (PointCloud{{1, 2, 3}, {4, 5, 6}}));
  }
}

TEST(Pcd, UsesWidthTimesHeightWithoutPoints) {
  const absl::StatusOr<Scan> scan =
      ReadPcd(absl::StrCat(kXyz, "WIDTH 1\nHEIGHT 2\nDATA ascii\n1 2 3\n4 5 6\n"));
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points.size(), 2U);
}

TEST(Pcd, ReadsAFileWithoutPointsAsAnEmptyScan) {
  for (const char* data : {"ascii", "binary", "binary_compressed"}) {
    const absl::StatusOr<Scan> scan =
        ReadPcd(absl::StrCat(kXyz, Counts(0, 1, 0), "DATA ", data, "\n"));
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_TRUE(scan->points.empty());
  }
}

TEST(Pcd, SkipsPaddingAndOtherFieldsOfBinaryRecords) {
  std::string content =
      absl::StrCat("FIELDS _ ring z _ x y\nSIZE 1 1 8 1 4 8\nTYPE U U F U F F\nCOUNT 3 1 1 4 1 1\n",
                   Counts(2, 1, 2), "DATA binary\n");
  for (const Point& p : PointCloud{{1, 2, 3}, {-4, -5, -6}}) {
    content += "pad\x07";
    AppendBytes(content, static_cast<double>(p.z));
    content += "more";
    AppendBytes(content, p.x);
    AppendBytes(content, static_cast<double>(p.y));
  }
  const absl::StatusOr<Scan> scan = ReadPcd(content);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points, (PointCloud{{1, 2, 3}, {-4, -5, -6}}));
}

TEST(Pcd, SkipsFieldsOfNoElements) {
  std::string content =
      absl::StrCat("FIELDS x _ y z _\nSIZE 4 1 4 4 8\nTYPE F U F F U\nCOUNT 1 0 1 1 0\n",
                   Counts(1, 1, 1), "DATA ");
  EXPECT_EQ(ReadPcd(content + "ascii\n1 2 3\n")->points, (PointCloud{{1, 2, 3}}));
  content += "binary\n";
  for (const float value : {1.0F, 2.0F, 3.0F}) AppendBytes(content, value);
  EXPECT_EQ(ReadPcd(content)->points, (PointCloud{{1, 2, 3}}));
}

TEST(Pcd, ReadsTextWithWindowsLineEndsTabsNanAndBlankLines) {
  const std::string rows = " 1\t2   3\r\n\r\nnan 0 0\r\n4 5e0 +6\r\n0 -inf 0\r\n";
  const absl::StatusOr<Scan> scan =
      ReadPcd(absl::StrReplaceAll(AsciiPcd("", 4), {{"\n", "\r\n"}}) + rows);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points, (PointCloud{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(scan->num_not_finite, 2U);
}

TEST(Pcd, CountsDoublesBeyondTheRangeOfFloatAsNotFinite) {
  std::string content =
      absl::StrCat("FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\n", Counts(2, 1, 2), "DATA binary\n");
  for (const double value : {1.0, 2.0, 3.0, 1e300, 0.0, 0.0}) AppendBytes(content, value);
  const absl::StatusOr<Scan> scan = ReadPcd(content);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points, (PointCloud{{1, 2, 3}}));
  EXPECT_EQ(scan->num_not_finite, 1U);
}

struct BadPcd {
  std::string content;
  std::string reason;
};

void ExpectRefusal(const BadPcd& bad) {
  SCOPED_TRACE(bad.reason);
  const absl::StatusOr<Scan> scan = ReadPcd(bad.content);
  ASSERT_FALSE(scan.ok());
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(scan.status().message()), HasSubstr(bad.reason));
}

std::string Header(const std::string& fields, const std::string& counts) {
  return absl::StrCat(fields, counts, "DATA ascii\n1 2 3\n4 5 6\n");
}

std::string Compressed(std::uint32_t num_compressed, std::uint32_t num_bytes,
                       const std::string& data) {
  std::string content = absl::StrCat(kXyz, Counts(2, 1, 2), "DATA binary_compressed\n");
  AppendBytes(content, num_compressed);
  AppendBytes(content, num_bytes);
  return content + data;
}

TEST(Pcd, RefusesBadHeadersWithTheReason) {
  const std::vector<BadPcd> table = {
      BadPcd{"# .PCD v0.7\n", "no DATA line"},
      BadPcd{Header("", Counts(2, 1, 2)), "0 fields named x"},
      BadPcd{Header("FIELDS a b c\n", Counts(2, 1, 2)), "0 fields named x"},
      BadPcd{Header("FIELDS x y z x\n", Counts(2, 1, 2)), "2 fields named x"},
      BadPcd{Header("FIELDS x y z\nFIELDS x y z\n", Counts(2, 1, 2)), "twice"},
      BadPcd{Header("FIELDS\n", Counts(2, 1, 2)), "names no field"},
      BadPcd{Header("FIELDS x y z\nSIZE 4 4\n", Counts(2, 1, 2)), "SIZE has 2 values"},
      BadPcd{Header("FIELDS x y z\nSIZE 4 4 3\n", Counts(2, 1, 2)), "SIZE \"3\""},
      BadPcd{Header("FIELDS x y z\nSIZE 4 4 -4\n", Counts(2, 1, 2)), "SIZE \"-4\""},
      BadPcd{Header("FIELDS x y z\nSIZE 2 4 4\n", Counts(2, 1, 2)), "SIZE 2"},
      BadPcd{Header("FIELDS x y z\nTYPE F F X\n", Counts(2, 1, 2)), "TYPE \"X\""},
      BadPcd{Header("FIELDS x y z\nTYPE F F I\n", Counts(2, 1, 2)), "field z has TYPE I"},
      BadPcd{Header("FIELDS x y z\nCOUNT 1 1 2\n", Counts(2, 1, 2)), "COUNT 2"},
      BadPcd{Header("FIELDS x y z\nCOUNT 1 1 0\n", Counts(2, 1, 2)), "COUNT 0"},
      BadPcd{Header("FIELDS x y z a b\nSIZE 4 4 4 8 8\nCOUNT 1 1 1 65536 65536\n", Counts(2, 1, 2)),
             "more than 65536 bytes"},
      BadPcd{Header(kXyz, ""), "neither POINTS nor WIDTH"},
      BadPcd{Header(kXyz, Counts(3, 1, 2)), "WIDTH 3 x HEIGHT 1 differs from POINTS 2"},
      BadPcd{Header(kXyz, Counts(100000000, 1, 100000000)), "at most 4000000"},
      BadPcd{Header(kXyz, "WIDTH 4294967296\nHEIGHT 4294967296\n"), "at most 4000000"},
      BadPcd{Header(kXyz, "POINTS 99999999999999999999\n"), "POINTS is not one whole number"},
      BadPcd{Header(kXyz, "POINTS -1\n"), "POINTS is not one whole number"},
      BadPcd{Header(kXyz, "POINTS 2\nCOLOUR 1\n"), "\"COLOUR\""},
      BadPcd{absl::StrCat(kXyz, Counts(1, 1, 1), "DATA morse\n1 2 3\n"), "\"morse\""}};
  for (const BadPcd& bad : table) ExpectRefusal(bad);
}

TEST(Pcd, RefusesBadBodiesWithTheReason) {
  const std::vector<BadPcd> table = {
      BadPcd{AsciiPcd("1 2 3\n4 5 6\n", 3), "truncated"},
      BadPcd{AsciiPcd("1.000 2.000 3.000\n4.00 5.00 6.00\n", 3), "only 2 rows follow"},
      BadPcd{AsciiPcd("1 2 3\n4 5 6\n", 4000000), "truncated"},
      BadPcd{AsciiPcd("1 2 3\n4 5 6\n7 8 9\n", 2), "line 12: more rows than the 2"},
      BadPcd{AsciiPcd("1 2 3\n4 five 6\n", 2), "line 11: \"five\" is not a number"},
      BadPcd{AsciiPcd("1 2 3\n4 5.0.0 6\n", 2), "\"5.0.0\" is not a number"},
      BadPcd{AsciiPcd("1 2 3\n4 5  \n", 2), "line 11: has 2 values"},
      BadPcd{AsciiPcd("1 2 3 4\n4 5 6 7\n", 2), "line 10: has 4 values"},
      BadPcd{AsciiPcd("1e6 2 3\n4e6 5 6\n", 2), "sensor frame"},
      BadPcd{absl::StrCat(kXyz, Counts(2, 1, 2), "DATA binary\n", std::string(23, 'a')),
             "need 24 bytes, but only 23 follow"},
      BadPcd{Compressed(4, 24, ""), "truncated: only 8 bytes follow"},
      BadPcd{Compressed(5, 24, "abcd"), "announces 5 compressed bytes, but 4 follow"},
      BadPcd{Compressed(0, 24, "abcd"), "announces 0 compressed bytes"},
      BadPcd{Compressed(4, 23, "abcd"), "its points need 24"},
      BadPcd{Compressed(4, 4294967295, "abcd"), "its points need 24"},
      BadPcd{Compressed(4, 24, "\xff\xff\xff\xff"), "damaged"},
      BadPcd{Compressed(4, 24,
                        "\x03"
                        "abc"),
             "damaged"},
      BadPcd{absl::StrCat(kXyz, Counts(4000000, 1, 4000000), "DATA binary_compressed\n",
                          std::string("\x04\0\0\0\0\x6c\xdc\x02", 8), "abcd"),
             "announces 48000000 bytes made of 4"}};
  for (const BadPcd& bad : table) ExpectRefusal(bad);
}

}  // namespace
}  // namespace scanloc::dataset
