#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace scanloc::report {

/// Keeps its keys in the order in which they were added.
using Json = nlohmann::ordered_json;

/// The document as ASCII with a line end: whatever a text holds, nothing in it steers a terminal.
/// Bytes that are not UTF-8, as file names may hold, become U+FFFD; numbers that are not finite
/// become null.
[[nodiscard]] inline std::string ToText(const Json& json) {
  return json.dump(2, ' ', true, Json::error_handler_t::replace) + "\n";
}

}  // namespace scanloc::report
