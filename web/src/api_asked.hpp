#pragma once

#include <cmath>
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

/// InvalidArgument that names what is no number.
template <typename Number>
[[nodiscard]] absl::StatusOr<Number> ToNumber(const char* name, const std::string& text) {
  Number number{};
  bool is_good = false;
  if constexpr (std::is_floating_point_v<Number>) {
    is_good = absl::SimpleAtod(text, &number) && std::isfinite(number);
  } else {
    is_good = absl::SimpleAtoi(text, &number);
  }
  if (is_good) return number;
  return absl::InvalidArgumentError(
      absl::StrCat(name, " is \"", text.substr(0, 40), "\"; it must be a number"));
}

[[nodiscard]] inline Response Document200(const Json& json) {
  return {.body = ToLine(json) + "\n"};
}

}  // namespace scanloc::web
