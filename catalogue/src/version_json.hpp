#pragma once

#include <nlohmann/json.hpp>

#include "absl/status/statusor.h"
#include "scanloc/catalogue/catalogue.hpp"

namespace scanloc::catalogue {

[[nodiscard]] nlohmann::json ToJson(const Version& version);
/// DataLoss: it is none.
[[nodiscard]] absl::StatusOr<Version> FromJson(const nlohmann::json& json);

}  // namespace scanloc::catalogue
