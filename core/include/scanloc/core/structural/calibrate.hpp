#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/map/map.hpp"

namespace scanloc {

/// Finds out, from the map alone, which of its places would be taken for each other
/// (docs/algorithm.md, "Confidence").
///
/// A trial takes a place as a later visit would see it: turned round, from another lane, part of
/// the view hidden, part of the structure gone or moved, some of it new. The surroundings of the
/// place are taken out of the map: whatever is found then is a look-alike.
///
/// Trials do not depend on each other, nor on the order in which they are run: the same map gives
/// the same results on any number of threads. Any number of threads may call Run at once.
class Calibrator {
 public:
  static constexpr std::size_t kMaxTrials = 200;
  /// So far around a place its surroundings go, on its own level: floors above and below remain.
  static constexpr double kFar_m = 60.0;

  /// Requires map->params.structure.enabled and structures.
  explicit Calibrator(std::shared_ptr<const Map> map);
  Calibrator(Calibrator&&) noexcept;
  Calibrator& operator=(Calibrator&&) noexcept;
  ~Calibrator();

  [[nodiscard]] std::size_t num_trials() const;

  struct Trial {
    std::int32_t place = 0;
    std::int32_t found = 0;   ///< the look-alike
    double confidence = 0.0;  ///< with which it would be told; 0 where nothing was found
  };
  /// About one query of time. i in [0, num_trials()). The errors of PayloadReader::Read.
  [[nodiscard]] absl::StatusOr<Trial> Run(std::size_t i) const;

 private:
  struct State;
  std::unique_ptr<const State> state_;
};

/// The pairs of places that would be taken for each other, worst first, at most kMaxConfusable.
inline constexpr std::size_t kMaxConfusable = 100;
[[nodiscard]] std::vector<ConfusablePair> FindConfusable(
    const std::vector<Calibrator::Trial>& trials);

}  // namespace scanloc
