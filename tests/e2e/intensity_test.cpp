// Methods that work on intensities: those of scans, and radar images taken along with them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include "e2e/programs.hpp"
#include "scanloc/dataset/drive.hpp"
#include "support/png_files.hpp"
#include "support/scan_files.hpp"

namespace scanloc::test {
namespace {

using nlohmann::json;

constexpr unsigned kNumAzimuths = 400;
constexpr unsigned kNumBins = 180;
constexpr double kBin_m = 0.5;

/// The power of each azimuth and range, azimuth by azimuth, as a radar above the LiDAR has it.
std::string PowersOf(const PointCloud& scan) {
  std::string powers(std::size_t{kNumAzimuths} * kNumBins, '\3');  // noise
  for (const Point& p : scan) {
    if (p.z < -1.0F) continue;  // the ground
    const double turn = std::atan2(-p.y, p.x) / (2.0 * std::numbers::pi);
    const auto azimuth = static_cast<unsigned>(std::lround((turn + 1.0) * kNumAzimuths));
    const auto bin = static_cast<unsigned>(std::hypot(p.x, p.y) / kBin_m);
    if (bin < kNumBins) powers[(azimuth % kNumAzimuths) * kNumBins + bin] = '\xb0';
  }
  return powers;
}

std::string OxfordPng(const std::string& powers) {
  std::string pixels;
  for (unsigned azimuth = 0; azimuth < kNumAzimuths; ++azimuth) {
    pixels += OxfordHead(azimuth * 5600 / kNumAzimuths);
    pixels += powers.substr(std::size_t{azimuth} * kNumBins, kNumBins);
  }
  return PngBytes(kNumBins + 11, kNumAzimuths, pixels);
}

/// As MulRan has it: 400 columns; more rows than columns are made up by silence.
std::string MulranPng(const std::string& powers) {
  constexpr unsigned kNumRows = 401;
  std::string pixels(std::size_t{kNumRows} * kNumAzimuths, '\0');
  for (unsigned azimuth = 0; azimuth < kNumAzimuths; ++azimuth) {
    for (unsigned bin = 0; bin < kNumBins; ++bin) {
      pixels[bin * kNumAzimuths + azimuth] = powers[azimuth * kNumBins + bin];
    }
  }
  return PngBytes(kNumAzimuths, kNumRows, pixels);
}

std::string AbovePng(const std::string& powers) {
  constexpr unsigned kSide = 320;
  std::string pixels(std::size_t{kSide} * kSide, '\0');
  for (unsigned row = 0; row < kSide; ++row) {
    for (unsigned col = 0; col < kSide; ++col) {
      const double x_m = (0.5 * kSide - 0.5 - row) * kBin_m;
      const double right_m = (col - 0.5 * kSide + 0.5) * kBin_m;
      const auto bin = static_cast<unsigned>(std::hypot(x_m, right_m) / kBin_m);
      const double turn = std::atan2(right_m, x_m) / (2.0 * std::numbers::pi);
      const auto azimuth =
          static_cast<unsigned>(std::lround((turn + 1.0) * kNumAzimuths)) % kNumAzimuths;
      if (bin < kNumBins) pixels[row * kSide + col] = powers[azimuth * kNumBins + bin];
    }
  }
  return PngBytes(kSide, kSide, pixels);
}

/// Renders an image for each scan of a drive, taken 50 ms later, by these layouts.
void Render(const TempDir& dir, const std::string& drive, const std::string& name) {
  const auto opened = dataset::OpenDrive(
      {.scans_dir = drive, .poses_file = drive + "/poses.txt", .times_file = drive + "/times.txt"});
  ASSERT_TRUE(opened.ok()) << opened.status();
  for (const dataset::Frame& frame : opened->frames) {
    const std::string powers = PowersOf(dataset::ReadScan(frame.file())->points);
    char stamp[32];
    std::snprintf(stamp, sizeof stamp, "%019lld.png",
                  static_cast<long long>(frame.stamp_ns + 50'000'000));
    dir.Write(name + "-oxford/" + stamp, OxfordPng(powers));
    dir.Write(name + "-mulran/" + stamp, MulranPng(powers));
    dir.Write(name + "-cartesian/" + stamp, AbovePng(powers));
  }
}

/// The drive once more, each point as bright as the block of 2 m of the world that it lies in.
void Brighten(const TempDir& dir, const std::string& drive, const std::string& name) {
  const auto opened = dataset::OpenDrive({.scans_dir = drive, .poses_file = drive + "/poses.txt"});
  ASSERT_TRUE(opened.ok()) << opened.status();
  for (const dataset::Frame& frame : opened->frames) {
    std::string bytes;
    const auto scan = dataset::ReadScan(frame.file());
    ASSERT_TRUE(scan.ok()) << scan.status();
    for (const Point& p : scan->points) {
      const Eigen::Vector3d at_m = frame.T_map_sensor * Eigen::Vector3d(p.x, p.y, p.z);
      std::uint64_t block = 0;
      for (const double value_m : at_m) {
        block = (block + static_cast<std::uint64_t>(std::lround(value_m / 2.0) + 100000)) *
                6364136223846793005ULL;
      }
      const float brightness = 0.01F * static_cast<float>(block >> 56U);
      for (const float value : {p.x, p.y, p.z, brightness}) AppendBytes(bytes, value);
    }
    dir.Write(name + "/" + frame.name, bytes);
  }
}

class Intensity : public ::testing::Test {
 protected:
  void SetUp() override {
    map_ = dir_.File("map.scanloc");
    MustScanloc({"build", map_, "--scans", Town().drive1, "--poses", Town().Poses1(), "--times",
                 Town().drive1 + "/times.txt", "--spacing-m", "0", "--quiet"});
  }
  [[nodiscard]] Args EvalArgs(const Args& more, const std::string& scans = Town().drive2) const {
    Args args = {"eval",    map_,
                 "--scans", scans,
                 "--poses", Town().Poses2(),
                 "--times", Town().drive2 + "/times.txt",
                 "--json",  "--quiet"};
    args.insert(args.end(), more.begin(), more.end());
    return args;
  }

  TempDir dir_;
  std::string map_;
};

TEST_F(Intensity, RadarImagesOfEveryLayoutAreJudgedBesideScans) {
  ASSERT_NO_FATAL_FAILURE(Render(dir_, Town().drive1, "map"));
  ASSERT_NO_FATAL_FAILURE(Render(dir_, Town().drive2, "query"));
  std::vector<double> recalls;
  for (const std::string layout : {"oxford", "mulran", "cartesian"}) {
    const json document = json::parse(MustScanloc(
        EvalArgs({"--method", "a-pc,a-pc-radar:5,a-cc-radar:5", "--radar",
                  dir_.File("query-" + layout), "--map-radar", dir_.File("map-" + layout),
                  "--radar-layout", layout, "--radar-resolution-m", "0.5", "--within-m", "4"})));
    ASSERT_EQ(document.at("results").size(), 3U);
    for (const json& result : document.at("results")) {
      EXPECT_GE(result.at("recall_at_1"), 0.8) << layout << " " << result.at("method");
    }
    recalls.push_back(document.at("results")[1].at("area_under_curve"));
  }
  EXPECT_NEAR(recalls[0], recalls[1], 0.02) << "the same powers at the same positions";
}

TEST_F(Intensity, ScansWithIntensitiesAreJudgedByThem) {
  ASSERT_NO_FATAL_FAILURE(Brighten(dir_, Town().drive1, "map"));
  ASSERT_NO_FATAL_FAILURE(Brighten(dir_, Town().drive2, "query"));
  const json document = json::parse(
      MustScanloc(EvalArgs({"--method", "a-pc-intensity:5,a-cc-intensity:5", "--map-scans",
                            dir_.File("map"), "--map-poses", Town().Poses1(), "--min-range-m", "2"},
                           dir_.File("query"))));
  for (const json& result : document.at("results")) EXPECT_GE(result.at("recall_at_1"), 0.9);
  // Scans of made towns have intensities, all 0.
  const ProcessResult dark = Scanloc(EvalArgs(
      {"--method", "pc-intensity", "--map-scans", Town().drive1, "--map-poses", Town().Poses1()}));
  EXPECT_EQ(dark.status, 1);
  EXPECT_NE(dark.err.find("all intensities"), std::string::npos) << dark.err;
}

TEST_F(Intensity, IsRefusedWhereItIsMissing) {
  dir_.Write("late/0000009000000000000.png", OxfordPng(PowersOf({})));
  for (const auto& [more, status, reason] :
       {std::tuple(Args{"--method", "a-pc-radar"}, 2, "need --radar"),
        {Args{"--method", "a-pc", "--radar", dir_.File("late")}, 2, "are for methods with -radar"},
        {Args{"--method", "pc-radar", "--radar", dir_.File("late"), "--radar-layout", "cartesian"},
         2, "needs --radar-resolution-m"},
        {Args{"--method", "pc-radar", "--radar", dir_.File("late"), "--query-tilt-deg", "3"}, 2,
         "does not go with"},
        {Args{"--method", "pc-radar", "--radar", dir_.File("late")}, 1,
         "has no radar image within 250000000 ns"},
        {Args{"--method", "pc-radar", "--radar", dir_.File("late")}, 1,
         "taken at 0 ns or not known"},
        {Args{"--method", "pc-radar", "--radar", dir_.File("none")}, 1, "cannot be listed"},
        {Args{"--method", "pc-intensity"}, 1, "give --map-scans"}}) {
    const ProcessResult refused = Scanloc(EvalArgs(more));
    EXPECT_EQ(refused.status, status) << reason << refused.err;
    EXPECT_NE(refused.err.find(reason), std::string::npos) << refused.err;
  }
}

}  // namespace
}  // namespace scanloc::test
