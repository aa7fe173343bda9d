#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "map/place_tree.hpp"
#include "scanloc/core/answer.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/scan_context/key_index.hpp"
#include "scanloc/core/search_control.hpp"
#include "scanloc/core/structural/verify.hpp"
#include "structural/bearing_grid.hpp"

namespace scanloc {

/// The search behind the method `auto` (docs/algorithm.md, "Beyond the paper"): a shortlist from
/// both kinds of context by keys of unit norm, then geometric verification.
/// Immutable after construction; any number of threads may search at once.
class AutoSearch {
 public:
  static constexpr int kShortlist = 100;  ///< places of each kind of context

  /// Requires map.params.structure.enabled. Keeps a reference to the map.
  explicit AutoSearch(const Map& map);

  struct Options {
    int shortlist = kShortlist;
    std::vector<Pose> predicted = {};  ///< T_map_query to be verified, too
  };

  /// Verified hypotheses, best first; none if there is nothing to verify.
  [[nodiscard]] std::vector<Hypothesis> Find(const ScanDescriptor& query, const Options& options,
                                             const SearchControl& control, StageTimes& times) const;

  /// T_map_query of a hypothesis, in six degrees of freedom: the planar registration, and the
  /// grounds of both scans laid on each other.
  [[nodiscard]] Pose PoseInMap(const Structure& query, const Hypothesis& hypothesis) const;

  /// The candidate that stands at a pose, told relative to the place nearest to it; none where all
  /// places are excluded.
  [[nodiscard]] std::optional<Candidate> CandidateAt(const Pose& T_map_query, double score,
                                                     double confidence,
                                                     const SearchControl& control) const;

 private:
  class Structures;

  /// Those of the poses predicted, verified.
  [[nodiscard]] std::vector<Hypothesis> VerifyPredicted(const Structure& query,
                                                        const std::vector<Pose>& predictions,
                                                        const SearchControl& control) const;

  const Map& map_;
  PlaceTree places_;
  std::vector<Pose> T_map_level_;      ///< of the places' levelled frames
  std::vector<BearingGrid> bearings_;  // of the places, widened
  std::unique_ptr<const KeyIndex> polar_;
  std::unique_ptr<const KeyIndex> cart_;
};

/// Fewer posts than this fit on almost anything.
inline constexpr std::size_t kMinPosts = 20;
/// What an unrelated place usually scores.
inline constexpr double kUnrelatedScore = 0.2;

/// What verified hypotheses say for the best of them.
struct Evidence {
  double score = 0.0;  ///< of the best
  double rival = 0.0;  ///< best score of a hypothesis elsewhere (rival_radius_m); 0 without one
};
[[nodiscard]] Evidence Weigh(const AutoSearch& search, const Structure& query,
                             const std::vector<Hypothesis>& verified);

/// The log-odds that the best hypothesis is right, by the map's calibration.
[[nodiscard]] double LogOdds(const Calibration& calibration, const Evidence& evidence);
/// The same as a probability.
[[nodiscard]] double Confidence(const Calibration& calibration, const Evidence& evidence);

}  // namespace scanloc
