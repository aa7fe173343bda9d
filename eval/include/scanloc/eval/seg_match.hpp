#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "scanloc/core/params.hpp"
#include "scanloc/eval/baseline.hpp"

namespace scanloc::eval {

/// SegMatch (Dubé, Dugas, Stumm, Nieto, Siegwart, Cadena: SegMatch: Segment Based Place Recognition
/// in 3D Point Clouds, ICRA 2017), from its description: the ground is taken away, what is left
/// falls apart into Euclidean segments, each is described by its eigenvalues, the nearest segments
/// of the map by these features are candidates, and a place is recognised by candidates whose
/// centroids agree in their distances from each other.
///
/// What is different: a segment is found in one scan, not in the scans of a whole local map; scans
/// are thinned to 0.5 m, as the map's are, so that segments are parted by free voxels and need
/// fewer points; no random forest, which needs a labelled drive, decides about candidates: the
/// distance between features does, each feature scaled by its spread over the map; and of its two
/// kinds of features the eigenvalues, not the histograms of shape. Written without a look at the
/// authors' code.
class SegMatch : public Baseline {
 public:
  static constexpr int kNumFeatures = 7;
  static constexpr int kRowLength = kNumFeatures + 3;
  static constexpr double kVoxelSize_m = 0.5;
  static constexpr double kReach_m = 60.0;  ///< radius of what is segmented
  static constexpr double kGround_m = 0.4;  ///< what lies no higher above ground is ground
  static constexpr int kLeastVoxels = 8;    ///< of a segment
  static constexpr int kMostVoxels = 2000;
  static constexpr int kNumNeighbors = 200;     ///< candidates of a segment of the query
  static constexpr double kResolution_m = 0.8;  ///< to which distances between centroids agree
  static constexpr int kLeastConsistent = 3;    ///< segments that recognise a place

  [[nodiscard]] std::string name() const override { return "segmatch"; }

  /// kRowLength numbers a segment: linearity, planarity, scattering, omnivariance, anisotropy,
  /// eigenentropy and change of curvature, then the centroid [m]. Empty without segments.
  [[nodiscard]] Eigen::VectorXf Describe(PointView scan) const override;

  void Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) override;
  /// Places by the number of segments that agree, and among equals by their features.
  [[nodiscard]] Answer Recognize(const BaselineQuery& query) const override;

 private:
  using Rows = Eigen::Matrix<float, Eigen::Dynamic, kRowLength, Eigen::RowMajor>;

  /// Segments that look alike.
  struct Pair {
    Eigen::Index of_query = 0;
    Eigen::Index of_map = 0;
    float distance = 0.0F;  ///< between their features, squared
  };
  [[nodiscard]] std::vector<std::vector<Pair>> FindPairs(const Rows& query,
                                                         const std::vector<bool>* excluded) const;
  [[nodiscard]] std::vector<Pair> LargestConsistent(const Rows& query,
                                                    const std::vector<Pair>& pairs) const;

  const Map* map_ = nullptr;
  Rows segments_;  // of all places; features scaled
  std::vector<std::int32_t> place_of_;
  Eigen::Matrix<float, 1, kNumFeatures> scale_;
};

}  // namespace scanloc::eval
