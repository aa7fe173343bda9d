#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>

#include "scanloc/core/answer.hpp"

namespace scanloc::test {

inline bool SameBits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

/// Over the wire a rotation is a quaternion: the same within rounding.
inline bool SamePose(const Pose& a, const Pose& b) {
  return (a.translation() - b.translation()).cwiseAbs().maxCoeff() < 1e-9 &&
         (a.linear() - b.linear()).cwiseAbs().maxCoeff() < 1e-14;
}

/// All but the times must be the same, numbers to the last bit, rotations to their rounding.
inline void ExpectSameAnswer(const Answer& actual, const Answer& expected) {
  EXPECT_EQ(actual.outcome, expected.outcome);
  EXPECT_EQ(actual.reason, expected.reason);
  EXPECT_EQ(actual.content_id, expected.content_id);
  ASSERT_EQ(actual.candidates.size(), expected.candidates.size());
  for (std::size_t i = 0; i < actual.candidates.size(); ++i) {
    const Candidate& a = actual.candidates[i];
    const Candidate& e = expected.candidates[i];
    EXPECT_EQ(a.place, e.place);
    EXPECT_EQ(a.session, e.session);
    EXPECT_EQ(a.session_name, e.session_name);
    EXPECT_EQ(a.map, e.map);
    EXPECT_TRUE(SamePose(a.T_map_place, e.T_map_place)) << "candidate " << i;
    EXPECT_TRUE(SameBits(a.distance, e.distance)) << "candidate " << i;
    EXPECT_EQ(a.confidence.has_value(), e.confidence.has_value());
    EXPECT_TRUE(SameBits(a.confidence.value_or(0.0), e.confidence.value_or(0.0)));
    EXPECT_TRUE(SameBits(a.yaw_rad, e.yaw_rad)) << "candidate " << i;
    EXPECT_TRUE(SameBits(a.lateral_m, e.lateral_m)) << "candidate " << i;
    EXPECT_TRUE(SamePose(a.T_map_query, e.T_map_query)) << "candidate " << i;
    EXPECT_EQ(a.geo, e.geo) << "candidate " << i;
    ASSERT_EQ(a.covariance.has_value(), e.covariance.has_value());
    if (a.covariance) {
      EXPECT_TRUE(a.covariance->isApprox(*e.covariance, 1e-9));
    }
  }
}

inline void ExpectPoseNear(const Pose& actual, const Pose& expected) {
  EXPECT_LT((actual.matrix() - expected.matrix()).cwiseAbs().maxCoeff(), 1e-9)
      << actual.matrix() << "\nexpected\n"
      << expected.matrix();
}

}  // namespace scanloc::test
