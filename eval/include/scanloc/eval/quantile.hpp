#pragma once

#include <optional>
#include <vector>

namespace scanloc::eval {

/// The value at `share` of the way through the sorted values: position share · (n - 1), linear
/// between its two neighbours; so the median of an even number is the mean of the middle two. None
/// of no values. Requires share in [0, 1].
[[nodiscard]] std::optional<double> Quantile(std::vector<double> values, double share);

/// None of no values.
[[nodiscard]] std::optional<double> Mean(const std::vector<double>& values);

/// What is said of many errors.
struct ErrorSummary {
  double median = 0.0;
  double mean = 0.0;
  double p90 = 0.0;  ///< nine in ten are no greater
};
/// None of no errors.
[[nodiscard]] std::optional<ErrorSummary> Summarize(const std::vector<double>& errors);

}  // namespace scanloc::eval
