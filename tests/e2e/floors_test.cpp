// Storeys that are alike but for what stands in their rooms.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "e2e/programs.hpp"

namespace scanloc::test {
namespace {

TEST(AlikeFloors, AreNotToldApartByWhatWasMoved) {
  const TempDir dir;
  const auto simulate = [&](const std::string& drive, const std::string& session,
                            const std::string& spacing_m) {
    MustScanloc({"simulate",
                 dir.File(drive),
                 "--world",
                 "office",
                 "--world-seed",
                 "8",
                 "--floors",
                 "3",
                 "--session-seed",
                 session,
                 "--spacing-m",
                 spacing_m,
                 "--rays",
                 "16",
                 "--azimuths",
                 "360",
                 "--min-elevation-deg",
                 "-20",
                 "--max-elevation-deg",
                 "20",
                 "--max-range-m",
                 "40",
                 "--sensor-height-m",
                 "0.8",
                 "--quiet"});
    return dir.File(drive);
  };
  const std::string mapped = simulate("mapped", "1", "2.5");
  const std::string asked = simulate("asked", "2", "4");
  MustScanloc({"build", dir.File("map"), "--scans", mapped, "--poses", mapped + "/poses.txt",
               "--sensor-height-m", "0.8", "--quiet"});
  const auto summary =
      nlohmann::json::parse(MustScanloc({"locate", dir.File("map"), "--scans", asked, "--truth",
                                         asked + "/poses.txt", "--json", "--quiet"}))
          .at("summary");
  EXPECT_GT(summary.at("num_queries"), 50) << summary.dump(2);
  EXPECT_EQ(summary.at("num_false"), 0) << summary.dump(2);
}

}  // namespace
}  // namespace scanloc::test
