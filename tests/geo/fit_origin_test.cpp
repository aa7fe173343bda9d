#include "scanloc/geo/fit_origin.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace scanloc::geo {
namespace {

/// A drive of 10 km whose receiver is off by some decimetres and, now and then, by a street.
std::vector<Fix> FixesOf(const GeoOrigin& truth, double share_of_jumps) {
  const GeoFrame frame = *GeoFrame::Create(truth);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.3);
  std::vector<Fix> fixes;
  for (int i = 0; i < 400; ++i) {
    const double s = 25.0 * i;
    const Eigen::Vector3d at(5e5 + s, 3e6 + 800.0 * std::sin(s / 900.0), 0.01 * s);
    Eigen::Vector3d received = at + Eigen::Vector3d(noise(random), noise(random), noise(random));
    if (i < 400 * share_of_jumps) received += Eigen::Vector3d(60.0, -35.0 + i, 20.0);
    fixes.push_back({at, frame.ToGeo(received)});
  }
  return fixes;
}

TEST(FitOrigin, FindsWhereTheMapLiesThoughAThirdOfTheFixesJump) {
  const GeoOrigin truth{51.5, -0.12, 60.0, 33.0, {5e5, 3e6, 0.0}};
  const std::vector<Fix> fixes = FixesOf(truth, 0.33);
  const auto fitted = FitOrigin(fixes);
  ASSERT_TRUE(fitted.ok()) << fitted.status();
  EXPECT_GE(fitted->num_used, 260U);
  EXPECT_LT(fitted->rms_m, 0.6);
  const GeoFrame right = *GeoFrame::Create(truth);
  const GeoFrame found = *GeoFrame::Create(fitted->origin);
  for (const Fix& fix : fixes) {
    const Eigen::Vector3d miss = right.ToMap(found.ToGeo(fix.at_map_m)) - fix.at_map_m;
    EXPECT_LT(miss.head<2>().norm(), 0.3);
    EXPECT_LT(std::abs(miss.z()), 8.0) << "level amid the fixes, the truth where it begins";
  }
  EXPECT_EQ(fitted->origin, FitOrigin(fixes)->origin);
}

TEST(FitOrigin, RefusesWhatSaysTooLittle) {
  const std::vector<Fix> fixes = FixesOf({51.5, -0.12, 60.0, 33.0, {5e5, 3e6, 0.0}}, 0.7);
  EXPECT_TRUE(absl::IsFailedPrecondition(FitOrigin(fixes).status())) << "too many jumps";
  EXPECT_FALSE(FitOrigin(std::span(fixes).first(4)).ok());
  const std::vector<Fix> standing(20, fixes.back());
  EXPECT_FALSE(FitOrigin(standing).ok());
}

}  // namespace
}  // namespace scanloc::geo
