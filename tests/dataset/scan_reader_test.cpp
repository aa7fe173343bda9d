#include "scanloc/dataset/scan_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>

#include "scanloc/core/limits.hpp"
#include "support/real_data.hpp"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::KittiBytes;
using test::RealData;
using test::SomePoints;
using test::TempDir;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

TEST(ScanReader, ReadsKittiBin) {
  const TempDir dir;
  const absl::StatusOr<Scan> scan = ReadScan(dir.Write("0.bin", KittiBytes(SomePoints(7))));
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points, SomePoints(7));
  EXPECT_EQ(scan->num_not_finite, 0U);
}

absl::StatusOr<Scan> ReadFromStream(const std::string& bytes) {
  std::FILE* stream = std::tmpfile();
  std::fwrite(bytes.data(), 1, bytes.size(), stream);
  std::rewind(stream);
  absl::StatusOr<Scan> scan = ReadScan(stream, "standard input");
  std::fclose(stream);
  return scan;
}

TEST(ScanReader, TellsTheFormatOfAStreamByItsBeginning) {
  const std::string pcd =
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n1 2 3\n";
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n1 2 3\n";
  for (const std::string& bytes :
       {pcd, "# .PCD v0.7\n" + pcd, ply, KittiBytes({{1, 2, 3}}), test::NaverBytes({{1, 2, 3}})}) {
    const absl::StatusOr<Scan> scan = ReadFromStream(bytes);
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->points, PointCloud({{1, 2, 3}})) << bytes.substr(0, 10);
  }
}

TEST(ScanReader, RefusesAStreamThatHoldsNoScan) {
  for (const auto& [bytes, why] : {std::pair<std::string, const char*>("", "is empty"),
                                   {"1234567", "7 bytes"},
                                   {"ply\nnonsense", "PLY"}}) {
    const absl::Status status = ReadFromStream(bytes).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr("standard input"), HasSubstr(why)));
  }
}

// Rows of num_floats: x y z, an intensity, and what follows as `last` says for each row.
std::string FloatRows(std::size_t num_points, std::size_t num_floats, float (*last)(std::size_t)) {
  std::string bytes;
  for (std::size_t i = 0; i < num_points; ++i) {
    const Point p = SomePoints(num_points)[i];
    for (std::size_t k = 0; k < num_floats; ++k) {
      const float values[] = {p.x, p.y, p.z, 0.5F};
      test::AppendBytes(bytes, k < 4 ? values[k] : last(i));
    }
  }
  return bytes;
}

TEST(ScanReader, ReadsRowsOfFiveFloatsThatEndInARing) {
  const TempDir dir;
  const std::string bytes = FloatRows(64, 5, [](std::size_t i) { return float(i % 32); });
  for (const char* name : {"0.pcd.bin", "0.bin"}) {
    const absl::StatusOr<Scan> scan = ReadScan(dir.Write(name, bytes));
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->points, SomePoints(64));
  }
}

TEST(ScanReader, RefusesRowsOfAnotherNumberOfFloats) {
  const TempDir dir;
  for (const std::size_t num_floats : {3, 5, 6, 7}) {
    const std::string bytes =
        FloatRows(160, num_floats, [](std::size_t i) { return 0.001F * static_cast<float>(i); });
    const absl::StatusOr<Scan> scan = ReadScan(dir.Write("0.bin", bytes));
    EXPECT_THAT(std::string(scan.status().message()), HasSubstr("intensities are negative"))
        << num_floats;
  }
}

TEST(ScanReader, NamesWhatStandsForAFile) {
  const TempDir dir;
  for (const char* name : {"0.bin", "0.pcd", "0.ply", "0.npy"}) {
    EXPECT_THAT(std::string(ReadScan(dir.Write(name,
                                               "version https://git-lfs.github.com/spec/v1\n"
                                               "oid sha256:00\nsize 1\n"))
                                .status()
                                .message()),
                AllOf(HasSubstr(name), HasSubstr("Git LFS pointer")));
    EXPECT_THAT(
        std::string(
            ReadScan(dir.Write(name, "/annex/objects/SHA256E-s1--00\n")).status().message()),
        HasSubstr("git-annex pointer"));
    EXPECT_THAT(
        std::string(ReadScan(dir.Write(name, "\x1F\x8B\x08\x08 and more")).status().message()),
        HasSubstr("compressed by gzip"));
    for (const auto& [begin, what] :
         {std::pair("<!DOCTYPE html><title>404</title>", "a page that a server sent"),
          {"<?xml version=\"1.0\"?><Error/>", "a page that a server sent"},
          {"BZh91AY&SY and more", "`bunzip2`"},
          {"PK\x03\x04 and more", "`unzip`"}}) {
      EXPECT_THAT(std::string(ReadScan(dir.Write(name, begin)).status().message()),
                  HasSubstr(what));
    }
  }
}

TEST(ScanReader, NamesTheFormatOfAFileOfAnotherName) {
  const TempDir dir;
  for (const auto& [name, begin, said] :
       {std::tuple("0.bin", "# .PCD v0.7\nVERSION 0.7\n", "as a .pcd file does, but is named .bin"),
        {"0.pcd", "ply\nformat ascii 1.0\n", "as a .ply file does, but is named .pcd"},
        {"0.ply", "\x93NUMPY\x01", "as a .npy file does, but is named .ply"}}) {
    EXPECT_THAT(std::string(ReadScan(dir.Write(name, begin)).status().message()), HasSubstr(said));
  }
}

TEST(ScanReader, AsksWhetherPointsAreMetresWhereNoneIsInReach) {
  const TempDir dir;
  PointCloud centimetres, kilometres;
  for (const Point& p : SomePoints(200)) {
    centimetres.push_back({200.0F + p.x, p.y, p.z});
    kilometres.push_back({0.001F * p.x, 0.001F * p.y, 0.001F * p.z});
  }
  EXPECT_THAT(
      std::string(ReadScan(dir.Write("cm.bin", KittiBytes(centimetres))).status().message()),
      HasSubstr("0 of its 200 points lie within 80 m of the sensor: are these metres"));
  EXPECT_THAT(std::string(ReadScan(dir.Write("km.bin", KittiBytes(kilometres))).status().message()),
              HasSubstr("0 of its 200 points lie beyond 1 m"));
}

TEST(ScanReader, DropsAndCountsPointsThatAreNotFinite) {
  const TempDir dir;
  const PointCloud points = {{1, 2, 3},     {kNaN, 0, 0}, {4, 5, 6},   {0, kInf, 0},
                             {0, 0, -kInf}, {7, 8, 9},    {10, 11, 12}};
  const absl::StatusOr<Scan> scan = ReadScan(dir.Write("0.bin", KittiBytes(points)));
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points, (PointCloud{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}}));
  EXPECT_EQ(scan->num_not_finite, 3U);
}

TEST(ScanReader, KeepsPointsBeyondTheLimitForTheVoxelFilterToCount) {
  const TempDir dir;
  const PointCloud points = {{1, 2, 3}, {5000, 0, 0}, {4, 5, 6}};
  const absl::StatusOr<Scan> scan = ReadScan(dir.Write("0.bin", KittiBytes(points)));
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points, points);
}

TEST(ScanReader, TakesExtensionsInEitherCase) {
  const TempDir dir;
  EXPECT_TRUE(ReadScan(dir.Write("0.BIN", KittiBytes(SomePoints(1)))).ok());
  EXPECT_TRUE(IsScanFile("a/b.PcD"));
  EXPECT_TRUE(IsScanFile("b.ply"));
  EXPECT_FALSE(IsScanFile("b.obj"));
  EXPECT_FALSE(IsScanFile("bin"));
}

TEST(ScanReader, ReadsBytesByTheNameOrByHowTheyBegin) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n1 2 3\n";
  for (const char* name : {"scan", "scan.ply", "scan.PLY"}) {
    const absl::StatusOr<Scan> scan = ReadScanBytes(ply, name);
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->points, (PointCloud{{1.0F, 2.0F, 3.0F}}));
  }
  const absl::Status as_another = ReadScanBytes(ply, "scan.pcd").status();
  EXPECT_EQ(as_another.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(as_another.message()), testing::StartsWith("scan.pcd"));
  EXPECT_EQ(ReadScanBytes("", "scan").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ScanReader, SaysThatAFileIsMissing) {
  const TempDir dir;
  const absl::StatusOr<Scan> scan = ReadScan(dir.File("none.bin"));
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(scan.status().message()), HasSubstr("none.bin"));
}

std::string Garbage(std::size_t num_bytes) {
  std::string bytes;
  std::uint32_t state = 12345;
  while (bytes.size() < num_bytes) {
    state = state * 1664525U + 1013904223U;
    bytes += static_cast<char>(state >> 24U);
  }
  return bytes;
}

struct BadFile {
  std::string name;
  std::string content;
  std::string reason;
};

void ExpectRefusal(const BadFile& bad) {
  SCOPED_TRACE(bad.name);
  const TempDir dir;
  const std::string path = dir.Write(bad.name, bad.content);
  const absl::StatusOr<Scan> scan = ReadScan(path);
  ASSERT_FALSE(scan.ok());
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(scan.status().message()), AllOf(HasSubstr(path), HasSubstr(bad.reason)));
}

TEST(ScanReader, RefusesBadFilesWithPathAndReason) {
  const std::vector<BadFile> table = {
      BadFile{"empty.bin", "", "empty"},
      BadFile{"empty.pcd", "", "empty"},
      BadFile{"empty.ply", "", "empty"},
      BadFile{"cut.bin", KittiBytes(SomePoints(3)).substr(0, 47), "47 bytes"},
      BadFile{"cut.bin", KittiBytes(SomePoints(3)).substr(0, 40), "velodyne_sync"},
      BadFile{"garbage.bin", Garbage(16000), "no LiDAR returns"},
      BadFile{"garbage.pcd", Garbage(16000), "PCD header"},
      BadFile{"garbage.ply", Garbage(16000), "PLY header"},
      BadFile{"nan.bin", KittiBytes(PointCloud(9, {kNaN, kNaN, kNaN})), "9 not finite"},
      BadFile{"far.bin", KittiBytes(PointCloud(9, {1e30F, 0, 0})), "9 beyond 4096 m"},
      BadFile{"tiny.bin", KittiBytes(PointCloud(9, {1.0F, 1e-30F, 0})), "9 with a coordinate"},
      BadFile{"zero.bin", KittiBytes(PointCloud(9)), "zero"},
      BadFile{"mesh.obj", "v 1 2 3\n", ".bin (KITTI), .npy (NAVER LABS), .pcd or .ply"},
      BadFile{"noextension", KittiBytes(SomePoints(3)), "no scan file"}};
  for (const BadFile& bad : table) ExpectRefusal(bad);
}

TEST(ScanReader, RefusesADirectory) {
  const TempDir dir;
  std::filesystem::create_directory(dir.path() / "folder.bin");
  const absl::StatusOr<Scan> scan = ReadScan(dir.File("folder.bin"));
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(scan.status().message()), HasSubstr("folder"));
}

TEST(ScanReader, RefusesAPipeWithoutWaitingForIt) {
  const TempDir dir;
  ASSERT_EQ(mkfifo(dir.File("pipe.bin").c_str(), 0600), 0);
  const absl::StatusOr<Scan> scan = ReadScan(dir.File("pipe.bin"));
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
}

// Sparse: it takes no room on the disk.
std::string WriteSparse(const TempDir& dir, const std::string& name, std::int64_t num_bytes) {
  std::string path = dir.Write(name, "");
  std::filesystem::resize_file(path, static_cast<std::uintmax_t>(num_bytes));
  return path;
}

TEST(ScanReader, RefusesAFileOverTheLimitOfBytes) {
  const TempDir dir;
  for (const char* name : {"big.bin", "big.pcd", "big.ply"}) {
    const absl::StatusOr<Scan> scan =
        ReadScan(WriteSparse(dir, name, limits::kMaxScanFileBytes + 1));
    EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(scan.status().message()), HasSubstr("at most 536870912"));
  }
}

TEST(ScanReader, RefusesABinOverTheLimitOfPoints) {
  const TempDir dir;
  const absl::StatusOr<Scan> scan = ReadScan(
      WriteSparse(dir, "big.bin", 16 * (static_cast<std::int64_t>(limits::kMaxPointsPerScan) + 1)));
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(scan.status().message()), HasSubstr("at most 4000000"));
}

TEST(ScanReaderOnRealData, ReadsEveryFormatOrSaysWhyNot) {
  SCANLOC_REAL_DATA_OR_SKIP(formats, "formats");
  struct Expected {
    std::string name;
    std::size_t num_points;
    std::size_t num_not_finite;
    Point first;
  };
  const std::vector<Expected> all = {
      {"apollo-with-nan.pcd", 101643, 9525, {-2.89481F, 0.992803F, -1.86707F}},
      {"hdl32-padded-fields.pcd", 64545, 0, {0.461427F, -3.75802F, -2.24543F}},
      {"vlp16-ascii.pcd", 22988, 0, {-1.14F, 0.0F, -0.3F}},
      {"width-zero-compressed.pcd", 1790, 0, {12.3804F, -15.7828F, 3.96369F}}};
  for (const Expected& expected : all) {
    SCOPED_TRACE(expected.name);
    const absl::StatusOr<Scan> scan = ReadScan(formats + "/" + expected.name);
    ASSERT_TRUE(scan.ok()) << scan.status();
    ASSERT_EQ(scan->points.size(), expected.num_points);
    EXPECT_EQ(scan->num_not_finite, expected.num_not_finite);
    for (const Point& p : scan->points) ASSERT_LT(std::hypot(p.x, p.y, p.z), 300.0F);
    EXPECT_NEAR(scan->points[0].x, expected.first.x, 1e-4);
    EXPECT_NEAR(scan->points[0].y, expected.first.y, 1e-4);
    EXPECT_NEAR(scan->points[0].z, expected.first.z, 1e-4);
  }
  const absl::StatusOr<Scan> nclt = ReadScan(formats + "/nclt-velodyne-sync.bin");
  EXPECT_EQ(nclt.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(nclt.status().message()), HasSubstr("velodyne_sync"));
  EXPECT_EQ(ReadScan(formats + "/delft-3dfier.obj").status().code(),
            absl::StatusCode::kInvalidArgument);
}

// Every scan of the recorded drives: a street at the sensor's range, none of it dropped.
TEST(ScanReaderOnRealData, ReadsEveryScanOfEveryFolder) {
  bool any = false;
  for (const char* folder : {"kitti-00-first-827m/velodyne", "kitti-00-full-scans",
                             "mulran-kaist03-21/Scans", "nclt-2013-01-10/velodyne"}) {
    const std::string path = RealData(folder);
    if (path.empty()) continue;
    for (const auto& entry : std::filesystem::directory_iterator(path)) {
      any = true;
      const absl::StatusOr<Scan> scan = ReadScan(entry.path().string());
      ASSERT_TRUE(scan.ok()) << scan.status();
      EXPECT_EQ(scan->num_not_finite, 0U) << entry.path();
      ASSERT_GT(scan->points.size(), 1000U) << entry.path();
      for (const Point& p : scan->points) {
        ASSERT_LT(std::hypot(p.x, p.y, p.z), 300.0F) << entry.path();
      }
    }
  }
  if (!any) GTEST_SKIP() << "no real data under " << test::RealDataRoot();
}

}  // namespace
}  // namespace scanloc::dataset
