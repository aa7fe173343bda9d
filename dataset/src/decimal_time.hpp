#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace scanloc::dataset {

inline constexpr std::int64_t kNanosecondsPerS = 1'000'000'000;

/// What the numbers of a file of stamps count.
enum class TimeUnit { kSeconds, kMilliseconds, kMicroseconds, kNanoseconds };

/// Its name: `s`, `ms`, `us` or `ns`.
[[nodiscard]] std::string_view TimeUnitName(TimeUnit unit);

/// The unit in which a stamp of our days is as large as this one: 10 digits before the point are
/// seconds, 13, 16 and 19 milliseconds, microseconds and nanoseconds. Small numbers, and what is no
/// number, count as seconds.
[[nodiscard]] TimeUnit LikelyUnit(std::string_view text);

/// A time as decimal text, such as "1567410201.7452047" or "1.0e-01", in nanoseconds: exact, and
/// rounded to the nearest where the text has more digits than that. None if the text is not a
/// number or its nanoseconds do not fit.
[[nodiscard]] std::optional<std::int64_t> ParseTimeAsNs(std::string_view text,
                                                        TimeUnit unit = TimeUnit::kSeconds);

}  // namespace scanloc::dataset
