#include "scanloc/slam/close_loops.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "described_drive.hpp"
#include "scanloc/eval/trajectory_error.hpp"
#include "slam/simulated_drives.hpp"

namespace scanloc::slam {
namespace {

using test::LoaderOf;
using test::OdometryPlan;
using test::TownDrive;
using test::TownParams;
using test::TruthOf;

TEST(CloseLoops, TakesTheDriftOutOfADrive) {
  const auto drive = sim::SimulatedDrive::Create(TownDrive(3, 1));
  ASSERT_TRUE(drive.ok());
  const mapdb::SessionPlan plan = OdometryPlan(*drive, 1.0);
  const auto closed = CloseLoops(TownParams(), plan, LoaderOf(*drive), {.spacing_m = 2.0});
  ASSERT_TRUE(closed.ok()) << closed.status();
  ASSERT_GE(closed->num_on(), 5U);
  const std::vector<Pose> truth = TruthOf(*drive);
  std::vector<Pose> odometry;
  for (const mapdb::PlannedScan& scan : plan.scans) odometry.push_back(scan.T_map_place);
  const double before_m = eval::CompareTrajectories(truth, odometry)->ape_m.rmse;
  const double after_m = eval::CompareTrajectories(truth, closed->T_map_scan)->ape_m.rmse;
  EXPECT_LT(after_m, before_m / 4.0) << after_m;
  EXPECT_TRUE(closed->T_map_scan.front().isApprox(plan.scans.front().T_map_place, 1e-12));
}

TEST(CloseLoops, GivesTheSameOnAnyNumberOfThreads) {
  sim::SimulateOptions options = TownDrive(3, 1);
  options.session.to_m = 500.0;
  const auto drive = sim::SimulatedDrive::Create(options);
  ASSERT_TRUE(drive.ok());
  const mapdb::SessionPlan plan = OdometryPlan(*drive, 1.0);
  const auto one =
      CloseLoops(TownParams(), plan, LoaderOf(*drive), {.spacing_m = 4.0, .num_threads = 1});
  const auto three =
      CloseLoops(TownParams(), plan, LoaderOf(*drive), {.spacing_m = 4.0, .num_threads = 3});
  ASSERT_TRUE(one.ok() && three.ok());
  for (std::size_t i = 0; i < plan.scans.size(); ++i) {
    EXPECT_EQ(one->T_map_scan[i].matrix(), three->T_map_scan[i].matrix());
  }
}

TEST(CloseLoops, LeavesADriveWithoutLoopsAsItIs) {
  sim::SimulateOptions options = TownDrive(3, 1);
  options.session.to_m = 60.0;
  const auto drive = sim::SimulatedDrive::Create(options);
  ASSERT_TRUE(drive.ok());
  const mapdb::SessionPlan plan = OdometryPlan(*drive, 1.0);
  const auto closed = CloseLoops(TownParams(), plan, LoaderOf(*drive));
  ASSERT_TRUE(closed.ok()) << closed.status();
  EXPECT_TRUE(closed->constraints.empty());
  for (std::size_t i = 0; i < plan.scans.size(); ++i) {
    EXPECT_EQ(closed->T_map_scan[i].matrix(), plan.scans[i].T_map_place.matrix());
  }
}

TEST(LookAhead, LeavesOutWhatSlippedAlongAWall) {
  mapdb::SessionPlan plan{.name = "drive", .scans = {}};
  std::vector<Constraint> ahead;
  constexpr std::size_t kSlipped = 7;
  constexpr std::size_t kTurned = 11;
  for (std::size_t i = 0; i < 20; ++i) {
    const Pose at(Eigen::Translation3d(6.0 * static_cast<double>(i), 0.0, 0.0));
    plan.scans.push_back({std::to_string(i), 0, at});
    if (i == 0) continue;
    // An odometry that is a twelfth too short all along.
    Pose shown(Eigen::Translation3d(i == kSlipped ? 12.5 : 6.5, 0.0, 0.0));
    if (i == kTurned) shown.rotate(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()));
    ahead.push_back({.from = i - 1, .to = i, .T_from_to = shown, .is_trusted = true});
  }
  const std::vector<Constraint> kept = WithoutSlips(ahead, plan);
  ASSERT_EQ(kept.size(), 17U);
  for (const Constraint& one : kept) {
    EXPECT_NE(one.to, kSlipped);
    EXPECT_NE(one.to, kTurned);
  }
  EXPECT_TRUE(WithoutSlips({}, plan).empty());
}

TEST(CloseLoops, PassesOverScansThatCannotBeRead) {
  sim::SimulateOptions options = TownDrive(3, 1);
  options.session.to_m = 60.0;
  const auto drive = sim::SimulatedDrive::Create(options);
  ASSERT_TRUE(drive.ok());
  const mapdb::SessionPlan plan = OdometryPlan(*drive, 1.0);
  const mapdb::ScanLoader some = [&](std::size_t i) -> absl::StatusOr<PointCloud> {
    if (i % 3 == 0) return absl::DataLossError("torn");
    return drive->Scan(i);
  };
  const auto closed = CloseLoops(TownParams(), plan, some);
  ASSERT_TRUE(closed.ok()) << closed.status();
  EXPECT_LT(closed->num_looked_at, plan.scans.size());
  EXPECT_EQ(closed->T_map_scan.size(), plan.scans.size());
}

TEST(CloseLoops, RefusesOptionsOutOfRange) {
  const auto drive = sim::SimulatedDrive::Create(TownDrive(3, 1));
  ASSERT_TRUE(drive.ok());
  const mapdb::SessionPlan plan = OdometryPlan(*drive, 1.0);
  for (const DriveOptions& bad :
       {DriveOptions{.spacing_m = -1.0}, DriveOptions{.window_m = 0.0},
        DriveOptions{.num_threads = 1000}, DriveOptions{.query = {.min_confidence = 2.0}}}) {
    EXPECT_TRUE(
        absl::IsInvalidArgument(CloseLoops(TownParams(), plan, LoaderOf(*drive), bad).status()));
  }
}

}  // namespace
}  // namespace scanloc::slam
