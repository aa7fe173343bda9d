#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include "absl/strings/str_cat.h"
#include "scanloc/dataset/scan_reader.hpp"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::AppendBytes;
using test::AppendBytesBigEndian;
using test::SomePoints;
using test::TempDir;
using ::testing::HasSubstr;

const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";

std::string Header(const std::string& format, std::size_t num_points,
                   const std::string& properties = kXyz) {
  return absl::StrCat("ply\nformat ", format, " 1.0\ncomment made by a test\nelement vertex ",
                      num_points, "\n", properties, "end_header\n");
}

absl::StatusOr<Scan> ReadPly(const std::string& content) {
  const TempDir dir;
  return ReadScan(dir.Write("scan.ply", content));
}

TEST(Ply, ReadsWhatPclWrites) {
  const TempDir dir;
  const PointCloud points = SomePoints(300);
  pcl::PointCloud<pcl::PointXYZ> cloud;
  for (const Point& p : points) cloud.push_back({p.x, p.y, p.z});
  ASSERT_EQ(pcl::io::savePLYFileASCII(dir.File("ascii.ply"), cloud), 0);
  ASSERT_EQ(pcl::io::savePLYFileBinary(dir.File("binary.ply"), cloud), 0);
  for (const char* name : {"ascii.ply", "binary.ply"}) {
    const absl::StatusOr<Scan> scan = ReadScan(dir.File(name));
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->points, points) << name;
  }
}

TEST(Ply, ReadsBothByteOrdersAndMixedTypes) {
  const std::string properties =
      "property uchar red\nproperty double y\nproperty int16 ring\nproperty float32 x\n"
      "property float64 z\n";
  std::string little = Header("binary_little_endian", 2, properties);
  std::string big = Header("binary_big_endian", 2, properties);
  for (const Point& p : PointCloud{{1, 2, 3}, {-4, -5, -6}}) {
    little += 'r';
    AppendBytes(little, static_cast<double>(p.y));
    little += "ri";
    AppendBytes(little, p.x);
    AppendBytes(little, static_cast<double>(p.z));
    big += 'r';
    AppendBytesBigEndian(big, static_cast<double>(p.y));
    big += "ri";
    AppendBytesBigEndian(big, p.x);
    AppendBytesBigEndian(big, static_cast<double>(p.z));
  }
  for (const std::string& content : {little, big}) {
    const absl::StatusOr<Scan> scan = ReadPly(content);
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->points, (PointCloud{{1, 2, 3}, {-4, -5, -6}}));
  }
}

TEST(Ply, ReadsTextWithNanAndIgnoresLaterElements) {
  const std::string content =
      "ply \r\nformat ascii 1.0 \r\nobj_info num_cols 1000000000\r\nelement vertex 3\r\n"
      "property float x\r\nproperty float y\r\nproperty float z\r\nproperty uchar blue\r\n"
      "element face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n"
      "1 2 3 255\r\nnan nan nan 0\r\n4 5 6 0\r\n3 0 1 2\r\n";
  const absl::StatusOr<Scan> scan = ReadPly(content);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points, (PointCloud{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(scan->num_not_finite, 1U);
}

TEST(Ply, ReadsAFileWithoutPointsAsAnEmptyScan) {
  for (const char* format : {"ascii", "binary_little_endian"}) {
    const absl::StatusOr<Scan> scan = ReadPly(Header(format, 0));
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_TRUE(scan->points.empty());
  }
}

struct BadPly {
  std::string content;
  std::string reason;
};

void ExpectRefusal(const BadPly& bad) {
  SCOPED_TRACE(bad.reason);
  const absl::StatusOr<Scan> scan = ReadPly(bad.content);
  ASSERT_FALSE(scan.ok());
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(scan.status().message()), HasSubstr(bad.reason));
}

TEST(Ply, RefusesBadFilesWithTheReason) {
  const std::vector<BadPly> table = {
      BadPly{"plyx\n", "not a PLY file"},
      BadPly{"ply\n", "no end_header"},
      BadPly{"ply\nend_header\n", "no format"},
      BadPly{"ply\nformat ascii 1.0\nend_header\n", "no vertex element"},
      BadPly{Header("morse", 1), "format is not"},
      BadPly{"ply\nformat ascii 2.0\nend_header\n", "format is not"},
      BadPly{"ply\nformat ascii 1.0\nformat ascii 1.0\n", "twice"},
      BadPly{"ply\nformat ascii 1.0\nproperty float x\n", "before any element"},
      BadPly{"ply\nformat ascii 1.0\nelement face 1\n", "must be vertex"},
      BadPly{"ply\nformat ascii 1.0\nelement vertex 1\nelement vertex 1\n", "only one"},
      BadPly{"ply\nformat ascii 1.0\nelement vertex -1\n", "element NAME COUNT"},
      BadPly{"ply\nnonsense\n", "\"nonsense\""},
      BadPly{Header("ascii", 100000000), "at most 4000000"},
      BadPly{Header("ascii", 1, ""), "one property x"},
      BadPly{Header("ascii", 1, "property int x\nproperty float y\nproperty float z\n"),
             "one property x"},
      BadPly{Header("ascii", 1, kXyz + "property float x\n"), "one property x"},
      BadPly{Header("ascii", 1, kXyz + "property quad q\n"), "\"quad\""},
      BadPly{Header("ascii", 1, kXyz + "property list uchar int i\n"), "lists are not read"},
      BadPly{Header("ascii", 2) + "1 2 3\n", "truncated"},
      BadPly{Header("ascii", 2) + "1.0000 2.0000 3.0000\n", "only 1 rows follow"},
      BadPly{Header("ascii", 1) + "1 2 x\n", "line 9: \"x\" is not a number"},
      BadPly{Header("ascii", 1) + "1 2 3 4\n", "line 9: has 4 values"},
      BadPly{Header("binary_little_endian", 2) + std::string(23, 'a'),
             "need 24 bytes, but only 23"},
      BadPly{Header("binary_big_endian", 4000000) + "abc", "truncated"}};
  for (const BadPly& bad : table) ExpectRefusal(bad);
}

}  // namespace
}  // namespace scanloc::dataset
