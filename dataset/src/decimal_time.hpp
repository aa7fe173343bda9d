#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace scanloc::dataset {

/// A time in seconds as decimal text, such as "1567410201.7452047" or "1.0e-01", in nanoseconds:
/// exact, and rounded to the nearest where the text has more digits than that. None if the text is
/// not a number or its nanoseconds do not fit.
[[nodiscard]] std::optional<std::int64_t> ParseSecondsAsNs(std::string_view text);

}  // namespace scanloc::dataset
