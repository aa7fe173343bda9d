#include "scanloc/dataset/radar.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "support/png_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::OxfordHead;
using test::PngBytes;
using test::TempDir;
using ::testing::HasSubstr;

/// The only point with an intensity.
struct Echo {
  double x_m = 0.0, y_m = 0.0;
  float power = 0.0F;
};
Echo EchoOf(const absl::StatusOr<Scan>& scan) {
  Echo echo;
  EXPECT_TRUE(scan.ok()) << scan.status();
  if (!scan.ok()) return echo;
  EXPECT_EQ(scan->points.size(), scan->intensities.size());
  for (std::size_t i = 0; i < scan->points.size(); ++i) {
    EXPECT_EQ(scan->points[i].z, 0.0F);
    if (scan->intensities[i] == 0.0F) continue;
    EXPECT_EQ(echo.power, 0.0F) << "a second echo";
    echo = {scan->points[i].x, scan->points[i].y, scan->intensities[i]};
  }
  return echo;
}

void ExpectEcho(const absl::StatusOr<Scan>& scan, double x_m, double y_m, float power) {
  const Echo echo = EchoOf(scan);
  EXPECT_NEAR(echo.x_m, x_m, 1e-4);
  EXPECT_NEAR(echo.y_m, y_m, 1e-4);
  EXPECT_EQ(echo.power, power);
}

TEST(Radar, ReadsOxfordsRowsByTheStepOfTheirEncoder) {
  // Of four rows the second, a quarter of a turn clockwise: to the right. An echo in bin 2 of 5.
  std::string pixels;
  for (unsigned row = 0; row < 4; ++row) {
    pixels += OxfordHead(row * 1400) + std::string(2, '\0') + (row == 1 ? '\xc8' : '\0') +
              std::string(2, '\0');
  }
  const auto scan = DecodeRadar(PngBytes(16, 4, pixels), RadarLayout::kOxford, 0.5);
  ExpectEcho(scan, 0.0, -1.25, 200.0F);
  EXPECT_EQ(scan->points.size(), 20U) << "the heads of rows are no range";
}

TEST(Radar, ReadsMulransColumnsAsAzimuths) {
  // 6 steps of range by 4 azimuths; an echo in step 5 of the fourth: three quarters clockwise.
  std::string pixels(24, '\0');
  pixels[5 * 4 + 3] = '\x07';
  ExpectEcho(DecodeRadar(PngBytes(4, 6, pixels), RadarLayout::kMulran, 2.0), 0.0, 11.0, 7.0F);
}

TEST(Radar, ReadsImagesFromAboveWithTheRadarInTheMiddle) {
  std::string pixels(25, '\0');
  pixels[0 * 5 + 3] = '\x09';  // the first row is ahead, the fourth column to the right
  ExpectEcho(DecodeRadar(PngBytes(5, 5, pixels), RadarLayout::kCartesian, 3.0), 6.0, -3.0, 9.0F);
}

TEST(Radar, KnowsTheResolutionOfThePublishedLayouts) {
  EXPECT_EQ(DefaultResolution_m(RadarLayout::kOxford), 0.0432);
  EXPECT_EQ(DefaultResolution_m(RadarLayout::kMulran), 0.0595);
  EXPECT_EQ(DefaultResolution_m(RadarLayout::kCartesian), std::nullopt);
}

TEST(Radar, RefusesWhatIsNoSuchImageAndSaysWhy) {
  const std::string grey(24, '\x10');
  std::string wide = PngBytes(12, 1, OxfordHead(0) + "a");
  // The header announces 60000 x 60000 pixels; its checksum is that of the same bytes.
  const std::string huge = PngBytes(60000, 60000, "");
  for (const auto& [bytes, layout, reason] :
       {std::tuple(std::string(), RadarLayout::kMulran, "no whole PNG"),
        {"not a PNG at all, by any means", RadarLayout::kMulran, "no whole PNG"},
        {huge, RadarLayout::kMulran, "60000 x 60000 pixels; at most 4000000"},
        {PngBytes(2, 4, grey, 8, 2), RadarLayout::kMulran, "8-bit greys"},
        {PngBytes(3, 4, grey, 16), RadarLayout::kMulran, "8-bit greys"},
        {PngBytes(6, 4, grey), RadarLayout::kMulran, "fewer azimuths"},
        {PngBytes(6, 4, grey), RadarLayout::kCartesian, "square"},
        {PngBytes(6, 4, grey), RadarLayout::kOxford, "has 6 columns"},
        {PngBytes(12, 2, grey), RadarLayout::kOxford, "row 0 has step 4112"},
        {PngBytes(12, 1, OxfordHead(5600) + "a"), RadarLayout::kOxford, "step 5600 of 5600"},
        {PngBytes(12, 1, OxfordHead(0, '\1') + "a"), RadarLayout::kOxford, "the mark 1"},
        {wide.substr(0, wide.size() - 20), RadarLayout::kOxford, "no whole PNG"}}) {
    const auto scan = DecodeRadar(bytes, layout, 0.5);
    EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument) << reason;
    EXPECT_THAT(std::string(scan.status().message()), HasSubstr(reason));
  }
}

TEST(Radar, TakesDamagedFilesForScansOrRefusesThem) {
  constexpr std::uint32_t kSeed = 5;
  std::string pixels;
  for (unsigned row = 0; row < 8; ++row) pixels += OxfordHead(row * 700) + std::string(40, 'x');
  const std::string good = PngBytes(51, 8, pixels);
  ASSERT_TRUE(DecodeRadar(good, RadarLayout::kOxford, 0.5).ok());
  for (std::size_t size = 0; size < good.size() - 12; ++size) {
    EXPECT_FALSE(DecodeRadar(good.substr(0, size), RadarLayout::kOxford, 0.5).ok()) << size;
  }
  std::mt19937 random(kSeed);
  for (int i = 0; i < 5000; ++i) {
    std::string bytes = good;
    bytes[random() % bytes.size()] = static_cast<char>(random());
    const auto scan = DecodeRadar(bytes, RadarLayout::kOxford, 0.5);
    if (scan.ok()) {
      EXPECT_EQ(scan->points.size(), scan->intensities.size()) << kSeed << " " << i;
    }
  }
}

TEST(Radar, ListsImagesByTheTimesOfTheirNames) {
  const TempDir dir;
  dir.Write("1547120789640420.png", "b");     // Oxford: microseconds
  dir.Write("1547120789640419999.PNG", "a");  // MulRan: nanoseconds
  dir.Write("radar.timestamps", "no image");
  const auto images = ListRadar(dir.path().string());
  ASSERT_TRUE(images.ok()) << images.status();
  ASSERT_EQ(images->size(), 2U);
  EXPECT_EQ((*images)[0].stamp_ns, 1547120789640419999);
  EXPECT_EQ((*images)[1].stamp_ns, 1547120789640420000);
  dir.Write("first.png", "c");
  EXPECT_THAT(std::string(ListRadar(dir.path().string()).status().message()),
              HasSubstr("\"first.png\" is not"));
  EXPECT_EQ(ListRadar(dir.File("nowhere")).status().code(), absl::StatusCode::kNotFound);
  std::filesystem::create_directory(dir.File("empty"));
  EXPECT_EQ(ListRadar(dir.File("empty")).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(Radar, TellsWhichFileIsBad) {
  const TempDir dir;
  const auto scan = ReadRadar(dir.Write("1.png", "nonsense"), RadarLayout::kMulran, 0.5);
  EXPECT_THAT(std::string(scan.status().message()), HasSubstr("1.png: no whole PNG"));
}

}  // namespace
}  // namespace scanloc::dataset
