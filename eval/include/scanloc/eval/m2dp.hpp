#pragma once

#include <Eigen/Core>
#include <string>

#include "scanloc/eval/vector_baseline.hpp"

namespace scanloc::eval {

/// M2DP (He, Wang, Zhang: M2DP: A Novel 3D Point Cloud Descriptor and Its Application in Loop
/// Closure Detection, IROS 2016), from its description, with its parameters: the cloud in the frame
/// of its principal axes is projected onto 4 × 16 planes, each projection counted in 8 rings × 16
/// sectors, and the first left and right singular vectors of these counts are the descriptor.
///
/// Where the paper leaves it open: an axis points to the side with the greater third moment; the
/// x-axis of a plane is the cloud's x-axis projected onto it, of the plane across x its y-axis;
/// singular vectors have a positive sum (the matrix has no negative element). As in the Scan
/// Context++ paper, scans are thinned to voxels of 0.1 m first. Written without a look at the
/// authors' code, which may decide these otherwise; docs/evaluation.md lists what that concerns.
class M2dp : public VectorBaseline {
 public:
  static constexpr int kNumAzimuths = 4;
  static constexpr int kNumElevations = 16;
  static constexpr int kNumRings = 8;
  static constexpr int kNumSectors = 16;
  static constexpr int kNumPlanes = kNumAzimuths * kNumElevations;
  static constexpr int kNumCells = kNumRings * kNumSectors;
  static constexpr int kLength = kNumPlanes + kNumCells;

  static constexpr double kVoxelSize_m = 0.1;

  [[nodiscard]] std::string name() const override { return "m2dp"; }

  /// Of length kLength: two unit vectors behind each other. Zero for scans of less than three
  /// voxels, or all of whose points lie in one line.
  [[nodiscard]] Eigen::VectorXf Describe(PointView scan) const override;

  /// The counts of a cloud of 3 × n points, each row over n: kNumPlanes × kNumCells. Empty where
  /// Describe gives zero.
  [[nodiscard]] static Eigen::MatrixXd Signatures(const Eigen::Matrix3Xd& points);
};

}  // namespace scanloc::eval
