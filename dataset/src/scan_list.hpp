#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

/// What the names of scan files say.
namespace scanloc::dataset {

/// The name without its extension.
[[nodiscard]] std::string_view Stem(std::string_view name);

/// Whether a text is digits only.
[[nodiscard]] bool IsNumber(std::string_view text);

/// When a scan was taken, if its name gives it: 19 digits [ns] or 16 digits [µs].
[[nodiscard]] std::optional<std::int64_t> StampOfName(std::string_view name);

}  // namespace scanloc::dataset
