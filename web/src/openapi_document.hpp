#pragma once

#include <string_view>

namespace scanloc::web {

/// openapi.json, as it was when this was built.
extern const std::string_view kOpenApiDocument;

}  // namespace scanloc::web
