#include "track/tracks.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/post_world.hpp"

namespace scanloc {
namespace {

using test::Offset;

/// A robot that drives along x on one of two alike floors, 4 m apart, and whose first scans tell
/// which. What its scans say is made up.
class Drive {
 public:
  explicit Drive(double rise_m) : step_(Offset(1.0, 0.0, rise_m, 0.0)) {
    Weigh({{0.0, 0.8, 0.0}, {4.0, 0.6, 6.0}}, 5.0, true);
    EXPECT_FALSE(IsOnItsFloor());  // one scan may err
    for (int i = 0; i < 2; ++i) Weigh({{0.0, 0.8, 0.0}, {4.0, 0.6, 6.0}}, 5.0, true);
    EXPECT_TRUE(IsOnItsFloor());
  }

  struct Seen {
    double floor_m, score, rivalry;
    double behind = 0.0;
  };
  /// Another metre, and these spots on it; beside the way where a spot is of neither floor.
  void Weigh(const std::vector<Seen>& seen, double genuine = 4.0, bool stands_alone = false) {
    Look look{.up = Eigen::Vector3d::UnitZ(), .genuine = genuine, .stands_alone = stands_alone};
    look.T_last_scan = step_;
    T_map_robot_ = T_map_robot_ * step_;
    for (const Seen& spot : seen) {
      Sighting& sighting = look.spots.emplace_back();
      sighting.T_map_scan = T_map_robot_;
      sighting.T_map_scan.translation().z() += spot.floor_m;
      sighting.score = spot.score;
      sighting.rivalry = spot.rivalry;
      sighting.behind = spot.behind;
    }
    tracks_.Weigh(look);
  }
  void SeeBoth(int times) {
    for (int i = 0; i < times; ++i) Weigh({{4.0, 0.75, 0.0}, {0.0, 0.7, 1.0}});
  }
  void SeeTheOther(int times, bool stands_alone = false) {
    for (int i = 0; i < times; ++i) Weigh({{4.0, 0.8, 0.0}}, 4.0, stands_alone);
  }
  void SeeNothing(int times) {
    for (int i = 0; i < times; ++i) {
      T_map_robot_ = T_map_robot_ * step_;
      tracks_.PassBlindly(step_);
    }
  }
  void Climb(int times, double rise_m) {
    for (int i = 0; i < times; ++i) {
      T_map_robot_.translation().z() += rise_m;
      SeeBoth(1);
    }
  }
  void StandBlindly() { tracks_.PassBlindly(Pose::Identity()); }

  /// By all its scans, with a confidence of 0.95.
  [[nodiscard]] bool IsOnItsFloor() const { return Share(0.0) > 0.95; }
  [[nodiscard]] double Share(double floor_m) const {
    double sum = 1.0;
    double here = 0.0;
    for (const Track& track : tracks_.tracks()) {
      const double weight = std::exp(track.standing());
      sum += weight;
      const Eigen::Vector3d off =
          track.pose.T_map_scan().translation() - T_map_robot_.translation();
      if (std::abs(off.z() - floor_m) < 0.5 && off.head<2>().norm() < 0.5) here += weight;
    }
    return here / sum;
  }

 private:
  Pose step_;
  Pose T_map_robot_ = Pose::Identity();
  Tracks tracks_{TrackParams{}};
};

constexpr double kRising = 0.001;  // odometry that tells of heights
constexpr double kFlat = 0.0;

TEST(Tracks, KeepItsFloorWhereTheFloorsAreAlike) {
  for (const double rise_m : {kRising, kFlat}) {
    Drive drive(rise_m);
    drive.SeeBoth(200);
    EXPECT_TRUE(drive.IsOnItsFloor()) << rise_m;
  }
}

TEST(Tracks, KeepItsFloorOverScansThatFindOnlyTheOther) {
  Drive drive(kRising);
  for (int i = 0; i < 10; ++i) {
    drive.SeeTheOther(3);
    drive.SeeBoth(1);
    EXPECT_TRUE(drive.IsOnItsFloor()) << i;
  }
}

TEST(Tracks, GiveItsFloorUpWhenTheOtherIsFoundAgainAndAgain) {
  Drive drive(kRising);
  drive.SeeTheOther(25);
  EXPECT_GT(drive.Share(4.0), 0.95);
  Drive told(kRising);
  told.SeeTheOther(5, true);  // sooner, where each scan alone says so
  EXPECT_GT(told.Share(4.0), 0.95);
}

TEST(Tracks, LoseALeadByAndByOverScansOfNothing) {
  Drive drive(kRising);
  drive.SeeBoth(3);
  drive.SeeNothing(10);
  drive.SeeBoth(1);
  EXPECT_TRUE(drive.IsOnItsFloor()) << drive.Share(0.0) << " " << drive.Share(4.0);
  drive.SeeNothing(100);
  drive.SeeBoth(1);
  EXPECT_FALSE(drive.IsOnItsFloor());
}

TEST(Tracks, LoseALeadAtOnceWhereALiftMayHaveTakenTheRobot) {
  Drive stands(kRising);
  stands.SeeBoth(3);
  stands.StandBlindly();
  stands.SeeBoth(1);
  EXPECT_NEAR(stands.Share(0.0), stands.Share(4.0), 0.05);
  Drive flat(kFlat);
  flat.SeeBoth(3);
  flat.SeeNothing(1);
  flat.SeeBoth(1);
  EXPECT_NEAR(flat.Share(0.0), flat.Share(4.0), 0.05);
}

TEST(Tracks, LoseALeadWhereOdometryThatKnowsNoHeightsIsFoundToClimb) {
  Drive drive(kFlat);
  drive.SeeBoth(3);
  EXPECT_TRUE(drive.IsOnItsFloor());
  drive.Climb(3, 0.3);
  EXPECT_NEAR(drive.Share(0.0), drive.Share(4.0), 0.05);
}

}  // namespace
}  // namespace scanloc
