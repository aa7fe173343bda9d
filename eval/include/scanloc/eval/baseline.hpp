#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scanloc/core/answer.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/scan/point_cloud.hpp"

/// Other ways of recognising places, to compare with. One file each.
namespace scanloc::eval {

/// What a baseline is asked.
struct BaselineQuery {
  PointView scan;
  const ScanDescriptor& descriptor;             ///< of the scan, made with the map's parameters
  std::size_t number = 0;                       ///< among the queries of the evaluation
  std::size_t num_answers = 1;                  ///< candidates told in the answer, at most
  std::optional<int> num_candidates{};          ///< k; none: the map's
  const std::vector<bool>* excluded = nullptr;  ///< as in SearchControl
  std::int64_t (*now_ns)() = nullptr;           ///< as in SearchControl
};

/// A way of recognising the places of a map. Once Prepare was called, any number of threads may ask
/// it.
class Baseline {
 public:
  virtual ~Baseline() = default;
  Baseline() = default;
  Baseline(const Baseline&) = delete;
  Baseline& operator=(const Baseline&) = delete;

  /// As methods are named on the command line.
  [[nodiscard]] virtual std::string name() const = 0;

  /// The kind of context that it works on, which the map must hold. None: it makes vectors of the
  /// scans, those of the map, too.
  [[nodiscard]] virtual std::optional<DescriptorKind> context_kind() const { return std::nullopt; }

  /// Whether Prepare takes what Describe makes of the scan of each place.
  [[nodiscard]] virtual bool needs_place_scans() const { return !context_kind(); }

  /// Whether BaselineQuery::num_candidates says anything to it; if not, it ranks all places.
  [[nodiscard]] virtual bool takes_candidates() const { return false; }

  /// What the baseline makes of a scan of the map; empty where it needs none.
  ///
  /// Finite; points that are not finite are left out. Thread-safe.
  [[nodiscard]] virtual Eigen::VectorXf Describe(PointView scan) const;

  /// Call once before Recognize. The map must stay. Requires the vector of each place's scan, or
  /// none for a baseline that needs none.
  virtual void Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) = 0;

  /// Candidates, best first; of equal ones the lower place. Their distance is in whatever the
  /// baseline compares by; their T_map_query is T_map_place, as it tells no pose. The outcome is
  /// left open. Where a clock is given, describe_ns is 0 for a baseline that works on contexts.
  [[nodiscard]] virtual Answer Recognize(const BaselineQuery& query) const = 0;
};

/// For maps of these parameters. Null: no baseline has that name.
[[nodiscard]] std::unique_ptr<Baseline> MakeBaseline(const std::string& name,
                                                     const Params& params = {});

/// The names, for people, with commas between.
[[nodiscard]] std::string BaselineNames();

/// For baselines: appends the place to the answer.
void AppendCandidate(const Map& map, std::size_t place, double distance, Answer* answer);
/// And the nearest of these places, nearest first; of equal ones the lower.
void AppendNearest(const Map& map, const std::map<std::int32_t, double>& distances, std::size_t num,
                   Answer* answer);

}  // namespace scanloc::eval
