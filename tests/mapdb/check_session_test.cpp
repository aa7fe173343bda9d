#include "scanloc/mapdb/check_session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numbers>
#include <string>

#include "scanloc/mapdb/merge_maps.hpp"
#include "support/scenes.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using testing::HasSubstr;

constexpr std::size_t kNumScans = 48;

/// From (-12, 0) on, by steps of a metre, each followed by a turn.
std::vector<Pose> DriveWith(const std::function<double(std::size_t)>& turn_deg) {
  std::vector<Pose> poses;
  Pose pose = Pose::Identity();
  pose.translation().x() = -12.0;
  for (std::size_t i = 0; i < kNumScans; ++i) {
    poses.push_back(pose);
    pose.translate(Eigen::Vector3d(1.0, 0.0, 0.0));
    pose = pose * PlanarOffset(0.0, turn_deg(i) * std::numbers::pi / 180.0);
  }
  return poses;
}

/// A drive among posts: straight, round a bend, straight again.
class CheckSessionTest : public testing::Test {
 protected:
  [[nodiscard]] SessionPlan Plan(const std::function<Pose(std::size_t)>& pose_of) const {
    SessionPlan plan{.name = "drive"};
    for (std::size_t i = 0; i < kNumScans; ++i) {
      plan.scans.push_back({std::to_string(i) + ".bin", 0, pose_of(i)});
    }
    return plan;
  }
  [[nodiscard]] SessionPlan RightPlan() const {
    return Plan([&](std::size_t i) { return poses_[i]; });
  }
  [[nodiscard]] ScanLoader Loader() const {
    return [this](std::size_t i) -> absl::StatusOr<PointCloud> {
      return scenes::SeenFrom(scene_, poses_[i]);
    };
  }
  [[nodiscard]] absl::Status Check(const std::function<Pose(std::size_t)>& pose_of,
                                   double spacing_m = 0.0) const {
    return CheckPoses(params_, Plan(pose_of), spacing_m, Loader());
  }

  Params params_;
  PointCloud scene_ = scenes::PostScan(7, 160);
  std::vector<Pose> poses_ =
      DriveWith([](std::size_t i) { return i >= 16 && i < 32 ? 11.0 : 0.0; });
};

TEST_F(CheckSessionTest, AcceptsPosesThatAgreeWithTheScans) {
  EXPECT_EQ(CheckPoses(params_, RightPlan(), 0.0, Loader()), absl::OkStatus());
}

TEST_F(CheckSessionTest, NamesTheMistakeThatPosesWereMadeWith) {
  using Eigen::Matrix3d;
  const auto scaled = [&](double factor) {
    return [this, factor](std::size_t i) {
      Pose pose = poses_[i];
      pose.translation() *= factor;
      return pose;
    };
  };
  const auto with_axes = [&](const Matrix3d& axes) {
    return [this, axes](std::size_t i) {
      Pose pose = Pose::Identity();
      pose.linear() = axes * poses_[i].linear() * axes.transpose();
      pose.translation() = axes * poses_[i].translation();
      return pose;
    };
  };
  const auto of_body = [&](double sensor_deg) {
    const Pose T_sensor_body = PlanarOffset(0.0, -sensor_deg * std::numbers::pi / 180.0);
    return [this, T_sensor_body](std::size_t i) { return poses_[i] * T_sensor_body; };
  };
  const auto mirrored = [&](const Eigen::Vector3d& factors) {
    return [this, factors](std::size_t i) {
      Pose pose = poses_[i];
      pose.translation() = factors.cwiseProduct(pose.translation());
      return pose;
    };
  };
  Matrix3d of_camera;
  of_camera << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  Matrix3d swapped;
  swapped << 0, 1, 0, 1, 0, 0, 0, 0, 1;
  const struct {
    const char* cause;
    std::function<Pose(std::size_t)> pose_of;
  } kCases[] = {
      {"millimetres", scaled(1000.0)},
      {"translations are in feet", scaled(1.0 / 0.3048)},
      {"scans are in feet", scaled(0.3048)},
      {"5 times as long by the poses", scaled(5.0)},
      {"inverted", [&](std::size_t i) { return poses_[i].inverse(); }},
      {"rotations are transposed",
       [&](std::size_t i) {
         Pose pose = poses_[i];
         pose.linear().transposeInPlace();
         return pose;
       }},
      {"have w first",
       [&](std::size_t i) {
         const Eigen::Quaterniond q(poses_[i].linear());
         Pose pose = poses_[i];
         pose.linear() = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
         return pose;
       }},
      {"of a camera", with_axes(of_camera)},
      {"y to the right", with_axes(Eigen::Vector3d(1, -1, 1).asDiagonal())},
      {"x and y swapped", with_axes(swapped)},
      {"x mirrored", mirrored({-1, 1, 1})},
      {"y mirrored", mirrored({1, -1, 1})},
      {"turned by 20 deg", of_body(20.0)},
      {"turned by -90 deg", of_body(-90.0)},
      {"reverse order", [&](std::size_t i) { return poses_[kNumScans - 1 - i]; }},
      {"3 scans later", [&](std::size_t i) { return poses_[i < 3 ? 0 : i - 3]; }},
  };
  for (const auto& c : kCases) {
    const absl::Status status = Check(c.pose_of);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << c.cause;
    EXPECT_THAT(std::string(status.message()), HasSubstr(c.cause));
  }
}

TEST_F(CheckSessionTest, NoticesKilometresThoughAllScansStandAtOnePlaceThen) {
  const auto in_kilometres = [&](std::size_t i) {
    Pose pose = poses_[i];
    pose.translation() *= 1e-3;
    return pose;
  };
  EXPECT_THAT(std::string(Check(in_kilometres, 1.0).message()), HasSubstr("kilometres"));
  poses_.assign(kNumScans, Pose::Identity());
  EXPECT_EQ(Check(in_kilometres, 1.0), absl::OkStatus()) << "a robot that stands";
}

TEST_F(CheckSessionTest, NoticesAShiftByOneScanWhereTheDriveWinds) {
  poses_ = DriveWith([](std::size_t i) { return i / 3 % 2 == 0 ? 6.0 : -6.0; });
  const auto shifted = [&](std::ptrdiff_t by) {
    return [this, by](std::size_t i) {
      const auto last = static_cast<std::ptrdiff_t>(kNumScans) - 1;
      const auto at = std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(i) + by, 0, last);
      return poses_[static_cast<std::size_t>(at)];
    };
  };
  EXPECT_EQ(Check(shifted(0)), absl::OkStatus());
  EXPECT_THAT(std::string(Check(shifted(1)).message()), HasSubstr("taken 1 scan earlier"));
  EXPECT_THAT(std::string(Check(shifted(-1)).message()), HasSubstr("taken 1 scan later"));
  // In scans, whatever becomes a place.
  EXPECT_THAT(std::string(Check(shifted(-2), 1.9).message()), HasSubstr("taken 2 scans later"));
}

TEST_F(CheckSessionTest, SaysNothingOfMotionsAlongWallsThatLookTheSameEverywhere) {
  PointCloud corridor;
  for (float x = -60.0F; x <= 100.0F; x += 0.25F) {
    for (float y = -5.0F; y <= 5.0F; y += 0.5F) corridor.push_back({x, y, -2.0F});
    for (const float y : {-5.1F, 5.2F}) {
      for (int z = 0; z <= 12; ++z) {
        corridor.push_back({x, y, -2.0F + static_cast<float>(z) / 3.0F});
      }
    }
  }
  poses_ = DriveWith([](std::size_t) { return 0.0; });
  for (Pose& pose : poses_) pose.translation() *= 0.7;
  scene_ = corridor;
  EXPECT_EQ(CheckPoses(params_, RightPlan(), 0.0, Loader()), absl::OkStatus());
}

TEST_F(CheckSessionTest, NoticesFilesInTheOrderOfTheirTexts) {
  std::vector<std::size_t> order(kNumScans);
  for (std::size_t i = 0; i < kNumScans; ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [](std::size_t a, std::size_t b) { return std::to_string(a) < std::to_string(b); });
  const absl::Status status = CheckPoses(params_, RightPlan(), 0.0, [&](std::size_t i) {
    return absl::StatusOr<PointCloud>(scenes::SeenFrom(scene_, poses_[order[i]]));
  });
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("order of the files is that of their names as text"));
}

TEST_F(CheckSessionTest, ExpectsNothingInCommonOfViewsThatFaceOtherWays) {
  const PointCloud dense = scenes::PostScan(7, 1200);
  const auto narrow = [&](double turned_deg) {
    return [&, turned_deg](std::size_t i) -> absl::StatusOr<PointCloud> {
      const double yaw_rad = turned_deg * static_cast<double>(i) * std::numbers::pi / 180.0;
      PointCloud seen = scenes::SeenFrom(dense, poses_[i] * PlanarOffset(0.0, yaw_rad));
      std::erase_if(seen, [](const Point& p) { return std::abs(p.y) > 0.7F * p.x; });
      return seen;
    };
  };
  const auto turned = [&](double by_deg) {
    return Plan([&, by_deg](std::size_t i) {
      const double yaw_rad = by_deg * static_cast<double>(i) * std::numbers::pi / 180.0;
      return poses_[i] * PlanarOffset(0.0, yaw_rad);
    });
  };
  EXPECT_EQ(CheckPoses(params_, turned(100.0), 0.0, narrow(100.0)), absl::OkStatus());
  EXPECT_FALSE(CheckPoses(params_, turned(20.0), 0.0, narrow(0.0)).ok())
      << "the poses turn too much";
}

TEST_F(CheckSessionTest, SaysNothingWhereThereIsTooLittleToSee) {
  const auto bare = [](std::size_t) { return absl::StatusOr<PointCloud>(scenes::PostScan(1, 5)); };
  EXPECT_EQ(CheckPoses(params_, RightPlan(), 0.0, bare), absl::OkStatus());
}

TEST_F(CheckSessionTest, PassesOverScansThatCannotBeReadButNotOverAnInterrupt) {
  const auto unreadable = [](std::size_t) -> absl::StatusOr<PointCloud> {
    return absl::DataLossError("half a file");
  };
  EXPECT_EQ(CheckPoses(params_, RightPlan(), 0.0, unreadable), absl::OkStatus());
  const auto interrupted = [](std::size_t) -> absl::StatusOr<PointCloud> {
    return absl::CancelledError("interrupted");
  };
  EXPECT_TRUE(absl::IsCancelled(CheckPoses(params_, RightPlan(), 0.0, interrupted)));
}

TEST_F(CheckSessionTest, TellsByHowMuchASecondDriveStandsInAnotherFrame) {
  const test::TempDir dir;
  const std::string path = dir.File("a.scanloc");
  ASSERT_TRUE(BuildMap({.path = path, .params = params_}, RightPlan(), Loader()).ok());
  EXPECT_EQ(CheckFrame(path, RightPlan(), Loader()), absl::OkStatus());

  const SessionPlan moved = Plan([&](std::size_t i) {
    Pose pose = poses_[i];
    pose.pretranslate(Eigen::Vector3d(6.0, 0.0, 0.0));
    return pose;
  });
  EXPECT_EQ(CheckPoses(params_, moved, 0.0, Loader()), absl::OkStatus());
  const absl::Status status = CheckFrame(path, moved, Loader());
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("by 6.0"));

  // From some scan on, as where an odometry slipped.
  const SessionPlan slipped = Plan([&](std::size_t i) {
    Pose pose = poses_[i];
    if (3 * i > 2 * poses_.size()) pose.pretranslate(Eigen::Vector3d(6.0, 0.0, 0.0));
    return pose;
  });
  EXPECT_EQ(CheckFrame(path, slipped, Loader()).code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(CheckSessionTest, TellsWhichOfMergedMapsStandsInAnotherFrame) {
  const test::TempDir dir;
  const auto build = [&](const std::string& name, double by_m) {
    SessionPlan plan = Plan([&](std::size_t i) {
      Pose pose = poses_[i];
      pose.pretranslate(Eigen::Vector3d(by_m, 0.0, 0.0));
      return pose;
    });
    plan.name = name;
    EXPECT_TRUE(BuildMap({.path = dir.File(name), .params = params_}, plan, Loader()).ok());
  };
  const auto check = [&](const std::string& one, const std::string& two) {
    EXPECT_TRUE(MergeMaps(dir.File(one + two), {dir.File(one), dir.File(two)}).ok());
    return CheckParts(dir.File(one + two), {kNumScans, kNumScans});
  };
  build("a", 0.0);
  build("b", 0.1);
  build("c", 6.0);
  EXPECT_EQ(check("a", "b"), absl::OkStatus());
  const absl::Status status = check("a", "c");
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("by 6.0"));
}

}  // namespace
}  // namespace scanloc::mapdb
