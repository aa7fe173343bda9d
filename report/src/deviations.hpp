#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "scanloc/core/answer.hpp"

/// How T_map_query and its uncertainty are told.
namespace scanloc::report {

inline constexpr double kDegPerRad = 180.0 / std::numbers::pi;

/// Of the elements of a covariance: metres, then degrees.
inline constexpr std::array<const char*, 6> kDeviationNames = {
    "std_x_m", "std_y_m", "std_z_m", "std_roll_deg", "std_pitch_deg", "std_yaw_deg"};

inline double Deviation(const PoseCovariance& covariance, int i) {
  return std::sqrt(covariance(i, i)) * (i < 3 ? 1.0 : kDegPerRad);
}

/// Of the query in the map: of its x axis, counter-clockwise from the map's.
inline double HeadingDeg(const Candidate& candidate) {
  return Yaw(candidate.T_map_query) * kDegPerRad;
}

}  // namespace scanloc::report
