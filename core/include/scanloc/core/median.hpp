#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace scanloc {

/// The middle value, of an even number the upper one of the two. Requires a value.
template <typename Number>
[[nodiscard]] Number Median(std::vector<Number> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace scanloc
