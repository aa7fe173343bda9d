// Whatever happens to a scan file, reading it gives a scan of finite points or a clear refusal.
// Run under the asan preset, these tests also show that nothing is read or written out of bounds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ostream>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scan_decoders.hpp"
#include "scanloc/core/limits.hpp"
#include "support/scan_files.hpp"

namespace scanloc::dataset {
namespace {

using test::AppendBytes;
using test::AppendBytesBigEndian;
using test::KittiBytes;
using test::NaverBytes;
using test::SomePoints;

constexpr std::size_t kNumPoints = 20;

struct Sample {
  std::string name;
  absl::StatusOr<Scan> (*decode)(std::string_view bytes, bool with_intensities);
  std::string content;
  /// Any shorter file must be refused; text may lose its last digits and the rest be a scan.
  bool every_byte_counts = true;
};

void PrintTo(const Sample& sample, std::ostream* out) { *out << sample.name; }

std::string PcdHeader(const std::string& data) {
  return absl::StrCat(
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z _\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 4\nWIDTH ",
      kNumPoints, "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS ", kNumPoints, "\nDATA ", data,
      "\n");
}

std::string PlyHeader(const std::string& format) {
  return absl::StrCat("ply\nformat ", format, " 1.0\nelement vertex ", kNumPoints,
                      "\nproperty float x\nproperty float y\nproperty float z\nend_header\n");
}

std::string CompressedPcd() {
  // LZF without back references but one: literal runs of at most 32 bytes, after a control byte.
  std::string planes;
  for (const auto axis : {&Point::x, &Point::y, &Point::z}) {
    for (const Point& p : SomePoints(kNumPoints)) AppendBytes(planes, p.*axis);
  }
  std::string compressed;
  const std::size_t num_literal = planes.size() - 4;
  for (std::size_t i = 0; i < num_literal; i += 32) {
    const std::string run = planes.substr(i, std::min<std::size_t>(32, num_literal - i));
    compressed += static_cast<char>(run.size() - 1);
    compressed += run;
  }
  compressed += std::string("\x40\x03", 2);  // the last 4 bytes are those before them
  std::string content = PcdHeader("binary_compressed");
  AppendBytes(content, static_cast<std::uint32_t>(compressed.size()));
  AppendBytes(content, static_cast<std::uint32_t>(planes.size()));
  return content + compressed;
}

std::vector<Sample> MakeSamples() {
  std::string binary_pcd = PcdHeader("binary");
  std::string ascii_pcd = PcdHeader("ascii");
  std::string little_ply = PlyHeader("binary_little_endian");
  std::string big_ply = PlyHeader("binary_big_endian");
  std::string ascii_ply = PlyHeader("ascii");
  for (const Point& p : SomePoints(kNumPoints)) {
    for (const float value : {p.x, p.y, p.z}) {
      AppendBytes(binary_pcd, value);
      AppendBytes(little_ply, value);
      AppendBytesBigEndian(big_ply, value);
    }
    binary_pcd += "____";
    absl::StrAppend(&ascii_pcd, p.x, " ", p.y, " ", p.z, " 0 0 0 0\n");
    absl::StrAppend(&ascii_ply, p.x, " ", p.y, " ", p.z, "\n");
  }
  const std::string with_intensities =
      "VERSION .7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 20\n"
      "HEIGHT 1\nPOINTS 20\nDATA binary\n" +
      KittiBytes(SomePoints(kNumPoints));
  return {{"Kitti", DecodeKittiBin, KittiBytes(SomePoints(kNumPoints)), false},
          {"Npy", DecodeNpy, NaverBytes(SomePoints(kNumPoints))},
          {"BinaryPcd", DecodePcd, binary_pcd},
          {"CompressedPcd", DecodePcd, CompressedPcd()},
          {"PcdWithIntensities", DecodePcd, with_intensities},
          {"AsciiPcd", DecodePcd, ascii_pcd, false},
          {"LittleEndianPly", DecodePly, little_ply},
          {"BigEndianPly", DecodePly, big_ply},
          {"AsciiPly", DecodePly, ascii_ply, false}};
}

// From a block of exactly its size, so that a sanitizer sees each byte read beyond it.
absl::StatusOr<Scan> Decode(const Sample& sample, std::string_view content) {
  const std::vector<char> block(content.begin(), content.end());
  return sample.decode({block.data(), block.size()}, true);
}

void ExpectScanOrRefusal(const absl::StatusOr<Scan>& scan) {
  if (!scan.ok()) {
    EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument) << scan.status();
    EXPECT_GT(scan.status().message().size(), 10U);
    return;
  }
  EXPECT_LE(scan->points.size() + scan->num_not_finite, limits::kMaxPointsPerScan);
  EXPECT_TRUE(scan->intensities.empty() || scan->intensities.size() == scan->points.size());
  for (const Point& p : scan->points) {
    ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
  }
}

class ScanCorruption : public ::testing::TestWithParam<Sample> {};

TEST_P(ScanCorruption, SampleIsReadWhole) {
  const absl::StatusOr<Scan> scan = Decode(GetParam(), GetParam().content);
  ASSERT_TRUE(scan.ok()) << scan.status();
  // The back reference of the compressed sample repeats a z.
  const PointCloud expected = SomePoints(kNumPoints);
  ASSERT_EQ(scan->points.size(), expected.size());
  EXPECT_TRUE(std::equal(expected.begin(), expected.end() - 1, scan->points.begin()));
}

TEST_P(ScanCorruption, EveryTruncationIsRefusedOrAScan) {
  const Sample& sample = GetParam();
  const std::string_view content = sample.content;
  for (std::size_t size = 0; size < content.size(); ++size) {
    SCOPED_TRACE(absl::StrCat("cut to ", size, " bytes"));
    const absl::StatusOr<Scan> scan = Decode(sample, content.substr(0, size));
    ExpectScanOrRefusal(scan);
    if (sample.every_byte_counts) {
      EXPECT_FALSE(scan.ok());
    }
  }
}

TEST_P(ScanCorruption, FlippedBytesAreRefusedOrAScan) {
  constexpr int kNumMutations = 20000;
  constexpr std::uint32_t kSeed = 7;
  const Sample& sample = GetParam();
  std::mt19937 random(kSeed);
  for (int i = 0; i < kNumMutations; ++i) {
    SCOPED_TRACE(absl::StrCat("seed ", kSeed, ", mutation ", i));
    std::string content = sample.content;
    for (std::uint32_t num = 1 + random() % 4; num > 0; --num) {
      // Digits too, so that headers stay readable and lie.
      const std::uint32_t value = random();
      const std::uint32_t byte = value >> 8U;
      content[random() % content.size()] =
          static_cast<char>(value % 2 == 0 ? '0' + byte % 10 : byte);
    }
    ExpectScanOrRefusal(Decode(sample, content));
  }
}

TEST_P(ScanCorruption, ShuffledPiecesAreRefusedOrAScan) {
  constexpr int kNumMutations = 10000;
  constexpr std::uint32_t kSeed = 11;
  const Sample& sample = GetParam();
  std::mt19937 random(kSeed);
  for (int i = 0; i < kNumMutations; ++i) {
    SCOPED_TRACE(absl::StrCat("seed ", kSeed, ", mutation ", i));
    std::string content = sample.content;
    const std::string piece =
        sample.content.substr(random() % sample.content.size(), random() % 64);
    content.erase(random() % content.size(), random() % 64);
    content.insert(random() % (content.size() + 1), piece);
    ExpectScanOrRefusal(Decode(sample, content));
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, ScanCorruption, ::testing::ValuesIn(MakeSamples()),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace scanloc::dataset
