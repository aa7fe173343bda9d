// The scale of a map: learned from its scans, kept by whatever goes on with it.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "e2e/programs.hpp"

namespace scanloc::test {
namespace {

using json = nlohmann::json;

double ScaleOf(const std::string& map) {
  return json::parse(MustScanloc({"info", map, "--json"})).at("params").at("auto.scale");
}

Args BuildRoom(const TempDir& dir, const std::string& drive, const std::string& map,
               const Args& more = {}) {
  Args args = {"build",
               dir.File(map),
               "--scans",
               dir.File(drive),
               "--poses",
               dir.File(drive) + "/poses.txt",
               "--sensor-height-m",
               "0.3",
               "--spacing-m",
               "0",
               "--quiet"};
  args.insert(args.end(), more.begin(), more.end());
  return args;
}

void SimulateRoom(const TempDir& dir, const std::string& drive, const std::string& session) {
  MustScanloc({"simulate", dir.File(drive), "--world", "room", "--session-seed", session, "--rays",
               "16", "--azimuths", "360", "--sensor-height-m", "0.3", "--spacing-m", "1.5",
               "--quiet"});
}

TEST(Scale, IsLearnedFromTheScansUnlessItIsGiven) {
  const TempDir dir;
  SimulateRoom(dir, "room", "1");
  MustScanloc(BuildRoom(dir, "room", "learned"));
  EXPECT_LT(ScaleOf(dir.File("learned")), 1.0);
  MustScanloc(BuildRoom(dir, "room", "given", {"--scale", "1"}));
  EXPECT_EQ(ScaleOf(dir.File("given")), 1.0);
  EXPECT_NE(ContentId(dir.File("given")), ContentId(dir.File("learned")));
  EXPECT_EQ(ScaleOf(Town().map1), 1.0);
  for (const char* bad : {"0", "0.01", "5", "nan", "small", ""}) {
    EXPECT_NE(Scanloc(BuildRoom(dir, "room", "bad", {"--scale", bad})).status, 0) << bad;
  }
}

TEST(Scale, StaysThatOfTheMapWhenItIsResumedOrAppendedTo) {
  const TempDir dir;
  SimulateRoom(dir, "room", "1");
  MustScanloc(BuildRoom(dir, "room", "map", {"--scale", "0.5"}));
  MustScanloc(BuildRoom(dir, "room", "map", {"--resume"}));
  EXPECT_EQ(ScaleOf(dir.File("map")), 0.5);
  EXPECT_NE(Scanloc(BuildRoom(dir, "room", "map", {"--resume", "--scale", "1"})).status, 0);
  SimulateRoom(dir, "again", "2");
  Args append = BuildRoom(dir, "again", "map", {"--append"});
  append.erase(std::find(append.begin(), append.end(), "--sensor-height-m"),
               std::find(append.begin(), append.end(), "--spacing-m"));
  MustScanloc(append);
  EXPECT_EQ(ScaleOf(dir.File("map")), 0.5);
}

}  // namespace
}  // namespace scanloc::test
