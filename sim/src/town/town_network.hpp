#pragma once

#include <Eigen/Core>
#include <vector>

#include "random.hpp"
#include "scanloc/sim/town.hpp"

namespace scanloc::sim {

enum class StreetClass { kResidential, kCollector, kAvenue };

/// The streets of a town before anything is built along them.
struct Network {
  std::vector<Street> streets;
  std::vector<StreetClass> classes;  ///< one per street
  Path route;                        ///< exactly length_m long
};

/// A jittered grid of bending streets, somewhat larger than a drive of length_m needs, and a drive
/// through it that takes no street twice while it can avoid it.
[[nodiscard]] Network MakeNetwork(double length_m, Random random);

}  // namespace scanloc::sim
