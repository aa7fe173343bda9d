#pragma once

#include <optional>

#include "absl/status/status.h"
#include "scanloc/core/method.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/prior.hpp"

namespace scanloc {

/// What a query asks of a map beside its scan. A value: it can be stored, sent, compared and asked
/// again. What it leaves open is as the map's parameters have it.
struct Query {
  std::optional<Method> method;  ///< none: DefaultMethod of the map
  /// k, in [1, limits::kMaxCandidates]; none: the map's. With `auto`: places taken from each kind
  /// of context; none: AutoSearch's own.
  std::optional<int> num_candidates;
  std::optional<double> threshold;       ///< τ, in [0, 1]; none: the map's. Not with `auto`
  std::optional<double> min_confidence;  ///< in [0, 1]; none: the map's. Only with `auto`
  int max_answers = 1;  ///< candidates told, best first, in [1, limits::kMaxCandidates]
  Prior prior = {};     ///< where it was taken, as far as is known

  friend bool operator==(const Query&, const Query&) = default;
};

/// The method that the query is answered by.
[[nodiscard]] Method MethodOf(const Query& query, const Params& params);

/// OK, or InvalidArgument that names what is out of range or goes with another method;
/// FailedPrecondition if a map of these parameters does not serve the method.
[[nodiscard]] absl::Status Validate(const Query& query, const Params& params);

}  // namespace scanloc
