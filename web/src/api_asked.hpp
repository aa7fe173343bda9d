#pragma once

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <type_traits>

#include "absl/status/statusor.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "api.hpp"
#include "json.hpp"

namespace scanloc::web {

struct Api::Asked {
  const Request& request;
  std::map<std::string, std::string> parts;  ///< what stands for {name} in the path
  std::shared_ptr<const client::Client> client;

  [[nodiscard]] const std::string& part(const std::string& name) const { return parts.at(name); }
};

/// InvalidArgument that names what is no number, or none that fits.
template <typename Number>
[[nodiscard]] absl::StatusOr<Number> ToNumber(const char* name, const std::string& text) {
  Number number{};
  std::string wanted = "a finite number";
  if constexpr (std::is_floating_point_v<Number>) {
    if (absl::SimpleAtod(text, &number) && std::isfinite(number)) return number;
  } else {
    if (absl::SimpleAtoi(text, &number)) return number;
    using Limits = std::numeric_limits<Number>;
    wanted = absl::StrCat("a whole number from ", Limits::min(), " to ", Limits::max());
  }
  return absl::InvalidArgumentError(
      absl::StrCat(name, " is \"", text.substr(0, 40), "\"; it must be ", wanted));
}

[[nodiscard]] inline Response Document200(const Json& json) {
  return {.body = ToLine(json) + "\n"};
}

}  // namespace scanloc::web
