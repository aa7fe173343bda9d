#pragma once

#include "scanloc/core/scan/pose.hpp"

namespace scanloc {

/// Where a robot is, as reckoned from scan to scan and corrected by where each was found.
///
/// A Kalman filter each for the plane, the height, the heading and the tilt (Thrun, Burgard, Fox:
/// Probabilistic Robotics, chapter 3), with findings far off weighed less (Huber). What it is told
/// of the odometry are the numbers of a usual robot: they are no parameters of the map.
class ReckonedPose {
 public:
  /// As a scan was found.
  explicit ReckonedPose(const Pose& T_map_scan) : T_map_scan_(T_map_scan) {}

  [[nodiscard]] const Pose& T_map_scan() const { return T_map_scan_; }
  /// How far the robot has gone since it was last found [m].
  [[nodiscard]] double unseen_m() const { return unseen_m_; }

  /// By the pose of the next scan in the frame of the last.
  void Move(const Pose& T_last_scan);

  /// Draws it to where the scan was found. worse: at least 1, by how much more this finding errs
  /// than a good one. Odometry that does not reckon heights says nothing of height and tilt: these
  /// are taken over. up: a unit vector of the map's frame.
  void Correct(const Pose& T_map_found, double worse, bool reckons_height,
               const Eigen::Vector3d& up);

  /// Whether what was found lies too far from what was made of it to confirm it.
  [[nodiscard]] bool IsFarFrom(const Pose& T_map_found, const Eigen::Vector3d& up) const;

 private:
  struct Noise {
    double found;      // standard deviation of what a good scan finds
    double at_once;    // of what is reckoned from one scan to the next ...
    double per_metre;  // ... and more by the way that is gone
  };
  static constexpr Noise kPlane_m = {0.1, 0.02, 0.02};
  static constexpr Noise kHeight_m = {0.5, 0.02, 0.02};
  static constexpr Noise kHeading_deg = {1.0, 0.1, 0.2};
  static constexpr Noise kTilt_deg = {2.0, 0.1, 0.1};

  /// The share of the way to what was found that a correction goes.
  [[nodiscard]] double Gain(const Noise& noise, double off, double worse, double& variance) const;

  Pose T_map_scan_;
  double unseen_m_ = 0.0;
  double plane_variance_ = kPlane_m.found * kPlane_m.found;
  double height_variance_ = kHeight_m.found * kHeight_m.found;
  double heading_variance_ = kHeading_deg.found * kHeading_deg.found;
  double tilt_variance_ = kTilt_deg.found * kTilt_deg.found;
};

/// Whether a step tells more than how a robot moves in its own plane, as that of wheels does.
[[nodiscard]] bool ReckonsHeight(const Pose& T_last_scan);

}  // namespace scanloc
