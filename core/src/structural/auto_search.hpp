#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "absl/status/statusor.h"
#include "map/payload_view.hpp"
#include "map/place_tree.hpp"
#include "scanloc/core/answer.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/scan/bearing_grid.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/search_control.hpp"
#include "scanloc/core/structural/verify.hpp"
#include "structural/evidence.hpp"
#include "structural/query_match.hpp"
#include "structural/signature_index.hpp"
#include "structural/spares.hpp"
#include "structural/uncertainty.hpp"

namespace scanloc {

/// A pose that a query may have been taken at.
struct Spot {
  Hypothesis hypothesis;
  double score = 0.0;  ///< what rivals are weighed by: the hypothesis' one, WithInliers
  Pose T_map_query = Pose::Identity();
  // Only of the best few: AutoSearch::Options.
  std::optional<Support> support;
  std::optional<PoseCovariance> covariance;  ///< of T_map_query
};

/// The search behind the method `auto` (docs/algorithm.md, "Beyond the paper"): a shortlist from
/// signatures, then geometric verification.
/// Any number of threads may search at once.
class AutoSearch {
 public:
  /// Requires map.params.structure.enabled and a unit vector up in the map frame. Keeps a reference
  /// to the map. Signatures are shared with a search of another map where they are equal.
  AutoSearch(const Map& map, const Eigen::Vector3d& up, const AutoSearch* before = nullptr);

  /// Takes in the places that were appended to the map; up as it is known now. Amortised O(log² n)
  /// a place as long as up stays, else O(n); not beside a search.
  void Extend(const Eigen::Vector3d& up);

  struct Options {
    int shortlist = 0;                 ///< half of the places; at least ShortlistParams::num_places
    std::vector<Pose> predicted = {};  ///< T_map_query to be verified, too
    int num_supported = 1;             ///< spots whose support is looked at
    int num_measured = 1;              ///< spots whose covariance is
    bool are_predicted_near = false;   ///< the poses predicted are reckoned, not guessed
  };

  /// Where the query may have been taken: verified, all distinct poses, best first; none if there
  /// is nothing to verify. The errors of PayloadReader::Read.
  ///
  /// Beside the shortlist, the best spot's own rivals are looked at: the same place turned, shifted
  /// and reflected about its middle, and the places above and below it.
  [[nodiscard]] absl::StatusOr<std::vector<Spot>> Find(const ScanDescriptor& query,
                                                       const Options& options,
                                                       const SearchControl& control,
                                                       StageTimes& times) const;

  /// Up in the map frame, as its places say.
  [[nodiscard]] const Eigen::Vector3d& up() const { return up_; }

  /// The candidate that stands at a pose of such covariance, told relative to the place nearest to
  /// it; none where all places are excluded.
  [[nodiscard]] std::optional<Candidate> CandidateAt(
      const Pose& T_map_query, const std::optional<PoseCovariance>& covariance, double score,
      double confidence, const SearchControl& control) const;

 private:
  class Structures;

  /// Of a place's levelled frame.
  [[nodiscard]] Pose T_map_level(std::size_t place) const;
  /// T_map_query of a hypothesis, in six degrees of freedom: the planar registration, and the
  /// grounds of both scans laid on each other.
  [[nodiscard]] Pose PoseInMap(const Structure& query, const Hypothesis& hypothesis) const;
  /// How a query at a pose lies on the place nearest to it; none where all are excluded.
  [[nodiscard]] std::optional<Hypothesis> HypothesisAt(const Structure& query,
                                                       const Pose& T_map_query,
                                                       const SearchControl& control) const;
  /// The same, on a place.
  [[nodiscard]] Hypothesis HypothesisOn(const Structure& query, const Pose& T_map_query,
                                        std::size_t place) const;
  /// A query's posts in the directions in which they stand from a spot beside it.
  struct Aside {
    double left_m = 0.0;  ///< how far farther to the left than from the query they are taken to be
    BearingQuery bearings;
  };
  /// A place that its signature has found.
  struct Listed {
    std::int32_t place = 0;
    int rank = 0;  ///< by signatures
    double score = 0.0;
    bool is_usual = false;  ///< of rank num_usual or better
  };
  /// The usual ones first, best score first.
  [[nodiscard]] static bool IsBefore(const Listed& a, const Listed& b);
  /// The places whose signatures are most alike, in no order.
  [[nodiscard]] std::vector<Listed> Retrieve(const SignatureQuery& query,
                                             std::span<const Aside> asides, int num_usual,
                                             int num_places, const SearchControl& control) const;
  /// Takes so many of those listed, which may be in any order, out of the list, as IsBefore says:
  /// first those that are apart from all better ones.
  [[nodiscard]] std::vector<Listed> TakeApart(std::vector<Listed>& listed,
                                              std::size_t num_places) const;
  /// The shortlist: the places that every query looks at, and those that it asks for beyond.
  [[nodiscard]] std::array<std::vector<Listed>, 2> List(const SignatureQuery& query,
                                                        std::span<const Aside> asides,
                                                        int shortlist,
                                                        const SearchControl& control) const;
  /// How the query may lie on them, scored by how many directions agree: the best so many.
  [[nodiscard]] std::vector<Hypothesis> GuessesOn(std::span<const Listed> listed,
                                                  std::span<const Aside> asides,
                                                  std::size_t num_guesses) const;
  /// How the query may lie on the places of the shortlist, as List has them.
  [[nodiscard]] std::array<std::vector<Hypothesis>, 2> Propose(const ScanDescriptor& query,
                                                               int shortlist, PayloadView& payload,
                                                               const SearchControl& control,
                                                               StageTimes& times) const;
  /// Those of the poses predicted, verified.
  [[nodiscard]] std::vector<Hypothesis> VerifyPredicted(QueryMatch& match, const Structure& query,
                                                        PlaceStructures& places,
                                                        const Options& options,
                                                        const SearchControl& control) const;
  /// What the places around say of a place's ground; those excluded say nothing.
  [[nodiscard]] Unevenness UnevennessAround(std::int32_t place, const SearchControl& control) const;
  /// What one search has found out of the hypotheses that it looks at, mostly more than once.
  struct Looked {
    using Scores = std::map<std::tuple<std::int32_t, double, double, double>, double>;

    std::map<std::int32_t, PostLines> lines;  ///< of places, which may hold several spots
    Scores inliers;
    Scores with_beside;
  };
  /// Of a hypothesis, asked of `make` if it is not known.
  template <typename Make>
  [[nodiscard]] static double ScoreOf(const Hypothesis& hypothesis, Looked::Scores& known,
                                      Make make) {
    const PlanarPose& pose = hypothesis.T_place_query;
    const auto [score, is_new] =
        known.try_emplace({hypothesis.place, pose.x_m, pose.y_m, pose.yaw_rad});
    if (is_new) score->second = make();
    return score->second;
  }
  [[nodiscard]] static double InlierRatio(const QueryMatch& match, PlaceStructures& places,
                                          const Hypothesis& hypothesis, Looked& looked);
  /// Scores the spots; one with a hopeless hypothesis has no inliers. Sorts them, best first.
  void ScoreWithInliers(const QueryMatch& match, PlaceStructures& places, Looked& looked,
                        std::vector<Spot>& spots) const;
  /// The places nearest to a pose but its own, on its level, that see the same.
  [[nodiscard]] std::vector<std::int32_t> PlacesBeside(const Spot& spot, int num_places,
                                                       const SearchControl& control) const;
  /// What a spot's place and the places beside it see, in the frame of its own.
  [[nodiscard]] Structure MergedBeside(PlaceStructures& places, const Spot& spot, int num_beside,
                                       const SearchControl& control) const;
  /// Before a cohort, the best spots' scores on that, but for what they gain by it on average.
  /// Sorts them, best first.
  void ScoreWithBeside(QueryMatch& match, PlaceStructures& places, const SearchControl& control,
                       Looked& looked, std::vector<Spot>& spots) const;
  /// The verified hypotheses that are of distinct poses, best first; their own scores.
  [[nodiscard]] std::vector<Spot> Distinct(const Structure& query,
                                           std::vector<Hypothesis> verified) const;
  /// Heights at which there may be places, from the lowest to the highest.
  [[nodiscard]] std::vector<double> Levels() const;
  /// The query ahead and behind of a pose, where other places stand: a street looks alike a few
  /// doors on, and the shortlist need not hold those places.
  [[nodiscard]] std::vector<Hypothesis> HypothesesAlong(const Structure& query,
                                                        const Pose& T_map_query, std::int32_t place,
                                                        const SearchControl& control) const;
  /// What else the query may be at the best hypothesis' place, verified.
  [[nodiscard]] std::vector<Hypothesis> VerifyRivals(QueryMatch& match, const Structure& query,
                                                     PayloadView& payload, const Hypothesis& best,
                                                     const SearchControl& control) const;

  const Map& map_;
  PlaceTree places_;
  Eigen::Vector3d up_, east_, north_;  // right-handed
  double lowest_m_, highest_m_;        // of the places, along up_
  std::vector<double> levels_m_;       // heights along up_ that are probed for places
  std::size_t num_known_ = 0;          // places taken in
  SignatureIndex signatures_;
  mutable Spares<MatchGrids> spare_grids_;
};

/// Best first; those with equal scores stay in order.
void SortByScore(std::vector<Spot>& spots);

/// Whether one stands where the other does, but on another floor.
[[nodiscard]] bool IsAbove(const Spot& a, const Spot& b, const Eigen::Vector3d& up);

/// CohortShare of the best spot and of those elsewhere in the plane that every query looks at.
[[nodiscard]] double CohortShare(const std::vector<Spot>& spots, const EvidenceParams& params,
                                 const Eigen::Vector3d& up);
/// Confidences of the spots, those above or below the best as EvidenceParams::equal_floors says.
/// Requires the best one's support.
[[nodiscard]] std::vector<double> ConfidencesOf(const std::vector<Spot>& spots,
                                                const EvidenceParams& params,
                                                const Eigen::Vector3d& up);

/// How many posts stand in cells of their own: a post that is said twice counts once.
[[nodiscard]] std::size_t CountDistinct(std::span<const Post> posts, double cell_m);
/// Whether there are enough of these.
[[nodiscard]] bool ShowsEnough(std::span<const Post> posts, const AutoParams& params);

}  // namespace scanloc
