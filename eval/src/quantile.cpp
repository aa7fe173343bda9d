#include "scanloc/eval/quantile.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace scanloc::eval {

std::optional<double> Quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nullopt;
  std::ranges::sort(values);
  const double position = share * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::size_t>(std::floor(position));
  const std::size_t high = std::min(low + 1, values.size() - 1);
  return std::lerp(values[low], values[high], position - static_cast<double>(low));
}

std::optional<double> Mean(const std::vector<double>& values) {
  if (values.empty()) return std::nullopt;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::optional<ErrorSummary> Summarize(const std::vector<double>& errors) {
  if (errors.empty()) return std::nullopt;
  return ErrorSummary{*Quantile(errors, 0.5), *Mean(errors), *Quantile(errors, 0.9)};
}

}  // namespace scanloc::eval
