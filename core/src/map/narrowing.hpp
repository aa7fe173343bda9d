#pragma once

#include <cstddef>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/prior.hpp"

namespace scanloc {

/// The places of a map that a prior leaves out, beside those that are left out anyway.
struct Narrowing {
  std::vector<bool> excluded;  ///< one a place
  std::size_t num_places = 0;  ///< that are left
};

/// O(places). `excluded` may be null. InvalidArgument: the map has no session of a name.
[[nodiscard]] absl::StatusOr<Narrowing> Narrow(const Map& map, const Prior& prior,
                                               const std::vector<bool>* excluded);

}  // namespace scanloc
