#pragma once

#include <array>
#include <charconv>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace scanloc::sim {

/// The shortest text that reads back as the same number, whatever the locale.
inline std::string NumberText(double value) {
  std::array<char, 32> buffer{};
  return {buffer.data(), std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr};
}

/// InvalidArgument that names the field unless low ≤ value ≤ high; NaN is refused.
inline absl::Status CheckRange(absl::string_view field, double value, double low, double high) {
  if (value >= low && value <= high) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(field, " is ", NumberText(value),
                                                 "; it must be in [", NumberText(low), ", ",
                                                 NumberText(high), "]"));
}

}  // namespace scanloc::sim
