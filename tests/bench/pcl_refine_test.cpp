#include "support/pcl_refine.hpp"

#include <gtest/gtest.h>

#include "scanloc/core/scan/pose_difference.hpp"
#include "support/scenes.hpp"

namespace scanloc::bench {
namespace {

TEST(Refine, FindsThePoseFromAGuessNearby) {
  const PointCloud target = scenes::RandomScan(3, 1500);
  const Pose T_target_source = PlanarOffset(0.3, 0.1);
  const PointCloud source = scenes::SeenFrom(target, T_target_source);
  for (const Refiner refiner : {Refiner::kIcp, Refiner::kGicp}) {
    const Refined refined = Refine(refiner, source, target, PlanarOffset(0.0, 0.05), {});
    EXPECT_TRUE(refined.has_converged);
    EXPECT_GT(refined.num_iterations, 0);
    EXPECT_LT(refined.rmse_m, 0.1);
    const PoseDifference off = DifferenceOf(refined.T_target_source, T_target_source);
    EXPECT_LT(off.plane_m, 0.1);
    EXPECT_LT(off.heading_deg, 1.0);
  }
}

TEST(Refine, SaysSoWhereItCannot) {
  const PointCloud target = scenes::RandomScan(3, 1500);
  const Pose guess = PlanarOffset(1.0, 0.0);
  for (const Refiner refiner : {Refiner::kIcp, Refiner::kGicp}) {
    const Refined none = Refine(refiner, {}, target, guess, {});
    EXPECT_FALSE(none.has_converged);
    EXPECT_TRUE(none.T_target_source.isApprox(guess));
    const PointCloud far = scenes::SeenFrom(target, PlanarOffset(1000.0, 0.0));
    EXPECT_FALSE(Refine(refiner, far, target, Pose::Identity(), {}).has_converged);
  }
}

}  // namespace
}  // namespace scanloc::bench
