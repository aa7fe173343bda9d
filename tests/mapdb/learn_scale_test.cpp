#include "scanloc/mapdb/learn_scale.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "absl/strings/str_format.h"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "support/building.hpp"
#include "support/real_data.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::size_t kNumScans = 100;

SessionPlan Plan(std::size_t num_scans = kNumScans) {
  SessionPlan plan{.name = "drive"};
  for (std::size_t i = 0; i < num_scans; ++i) {
    plan.scans.push_back({std::to_string(i) + ".bin", 0, Pose::Identity()});
  }
  return plan;
}

absl::StatusOr<PointCloud> Room(std::size_t /*scan*/) { return test::RoomScan(7.0F, 5.0F, 1, 8); }
absl::StatusOr<PointCloud> Street(std::size_t /*scan*/) {
  return test::RoomScan(90.0F, 30.0F, 1, 8);
}

TEST(LearnScale, TellsRoomsFromStreetsByMostOfTheirScans) {
  EXPECT_LT(*LearnScale(Params(), Plan(), Room), 1.0);
  EXPECT_EQ(*LearnScale(Params(), Plan(), Street), 1.0);
  const auto both = [](std::size_t scan) { return scan % 10 < 4 ? Room(scan) : Street(scan); };
  EXPECT_EQ(*LearnScale(Params(), Plan(), both), 1.0);
}

// The walls of an aisle or an alley, measured every step_m.
PointCloud Walls(float step_m) {
  PointCloud points;
  for (float x_m = -23.0F; x_m <= 23.0F; x_m += step_m) {
    for (float z_m = -2.0F; z_m <= 1.0F; z_m += step_m) {
      for (const float y_m : {-1.5F, 1.5F}) points.push_back({x_m, y_m, z_m});
    }
  }
  return points;
}

// Three quarters of what is seen lie as far away as in many a street.
TEST(LearnScale, TellsALongAisleFromAStreetByWhatIsNear) {
  const auto aisle = [](std::size_t) -> absl::StatusOr<PointCloud> { return Walls(0.1F); };
  EXPECT_LT(*LearnScale(Params(), Plan(), aisle), 1.0);
}

TEST(LearnScale, IsThatOfAStreetWhereTheSmallScaleShowsNoMore) {
  const auto alley = [](std::size_t) -> absl::StatusOr<PointCloud> { return Walls(0.5F); };
  EXPECT_EQ(*LearnScale(Params(), Plan(), alley), 1.0);
}

// Half of what they show lies within 11.9 and 9.5 m.
TEST(LearnScaleOnRealData, IsThatOfAStreetInTheNarrowPartsOfACampus) {
  SCANLOC_REAL_DATA_OR_SKIP(root, "nclt-2013-01-10");
  const auto from = [&](std::size_t first) {
    return [&root, first](std::size_t scan) -> absl::StatusOr<PointCloud> {
      ASSIGN_OR_RETURN(dataset::Scan read, dataset::ReadScan(absl::StrFormat("%s/velodyne/%06d.bin",
                                                                             root, first + scan)));
      return std::move(read.points);
    };
  };
  EXPECT_EQ(*LearnScale(Params(), Plan(276), from(0)), 1.0);
  EXPECT_EQ(*LearnScale(Params(), Plan(60), from(180)), 1.0);
}

TEST(LearnScale, LooksAtAFewScansAllOverTheDrive) {
  std::set<std::size_t> seen;
  const auto load = [&](std::size_t scan) {
    seen.insert(scan);
    return Room(scan);
  };
  ASSERT_TRUE(LearnScale(Params(), Plan(), load).ok());
  EXPECT_EQ(seen.size(), 32U);
  EXPECT_GT(*seen.rbegin(), kNumScans - 5);
}

TEST(LearnScale, IsThatOfATownWhereNothingIsSeenAndPassesAnInterruptOn) {
  const auto nothing = [](std::size_t) { return absl::StatusOr<PointCloud>(PointCloud()); };
  const auto unreadable = [](std::size_t) -> absl::StatusOr<PointCloud> {
    return absl::DataLossError("half a file");
  };
  const auto interrupted = [](std::size_t) -> absl::StatusOr<PointCloud> {
    return absl::CancelledError("interrupted");
  };
  EXPECT_EQ(*LearnScale(Params(), Plan(), nothing), 1.0);
  EXPECT_EQ(*LearnScale(Params(), Plan(), unreadable), 1.0);
  EXPECT_EQ(*LearnScale(Params(), Plan(0), Room), 1.0);
  EXPECT_TRUE(absl::IsCancelled(LearnScale(Params(), Plan(), interrupted).status()));
}

}  // namespace
}  // namespace scanloc::mapdb
