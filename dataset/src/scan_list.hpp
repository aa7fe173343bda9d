#pragma once

#include <string_view>

/// What the names of scan files say.
namespace scanloc::dataset {

/// The name without its extension.
[[nodiscard]] std::string_view Stem(std::string_view name);

/// Whether a text is digits only.
[[nodiscard]] bool IsNumber(std::string_view text);

}  // namespace scanloc::dataset
