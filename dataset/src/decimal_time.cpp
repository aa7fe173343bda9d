#include "decimal_time.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <string>

namespace scanloc::dataset {
namespace {

constexpr int kMaxExponent = 1000;

struct Decimal {
  bool negative = false;
  std::string digits;  ///< without a point
  int point = 0;       ///< digits before the point
};

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

std::optional<int> ParseExponent(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  int exponent = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), exponent);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (std::abs(exponent) > kMaxExponent) return std::nullopt;
  return exponent;
}

std::optional<Decimal> ParseDecimal(std::string_view text) {
  Decimal decimal;
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) {
    decimal.negative = text.front() == '-';
    text.remove_prefix(1);
  }
  const std::size_t e = text.find_first_of("eE");
  if (e != std::string_view::npos) {
    const std::optional<int> exponent = ParseExponent(text.substr(e + 1));
    if (!exponent) return std::nullopt;
    decimal.point = *exponent;
    text = text.substr(0, e);
  }
  constexpr std::size_t kMaxDigits = 100;
  if (text.size() > kMaxDigits) return std::nullopt;
  const std::size_t point = std::min(text.find('.'), text.size());
  decimal.point += static_cast<int>(point);
  decimal.digits = text.substr(0, point);
  if (point < text.size()) decimal.digits += text.substr(point + 1);
  if (decimal.digits.empty() || !std::ranges::all_of(decimal.digits, IsDigit)) {
    return std::nullopt;
  }
  return decimal;
}

}  // namespace

std::string_view TimeUnitName(TimeUnit unit) {
  constexpr std::array<std::string_view, 4> kNames = {"s", "ms", "us", "ns"};
  return kNames[static_cast<std::size_t>(unit)];
}

TimeUnit LikelyUnit(std::string_view text) {
  const std::optional<Decimal> decimal = ParseDecimal(text);
  if (!decimal) return TimeUnit::kSeconds;
  const std::size_t num_zeros =
      std::min(decimal->digits.find_first_not_of('0'), decimal->digits.size());
  const int num_digits = decimal->point - static_cast<int>(num_zeros);
  if (num_digits >= 18) return TimeUnit::kNanoseconds;
  if (num_digits >= 15) return TimeUnit::kMicroseconds;
  return num_digits >= 12 ? TimeUnit::kMilliseconds : TimeUnit::kSeconds;
}

std::optional<std::int64_t> ParseTimeAsNs(std::string_view text, TimeUnit unit) {
  const std::optional<Decimal> decimal = ParseDecimal(text);
  if (!decimal) return std::nullopt;
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  constexpr std::array<int, 4> kExponents = {9, 6, 3, 0};
  // Of the nanoseconds.
  const int num_digits = decimal->point + kExponents[static_cast<std::size_t>(unit)];
  const auto digit = [&](int i) {
    const bool given = i >= 0 && i < static_cast<int>(decimal->digits.size());
    return given ? decimal->digits[static_cast<std::size_t>(i)] - '0' : 0;
  };
  std::int64_t ns = 0;
  for (int i = 0; i < num_digits; ++i) {
    if (ns > (kMax - digit(i)) / 10) return std::nullopt;
    ns = ns * 10 + digit(i);
  }
  if (digit(num_digits) >= 5) {
    if (ns == kMax) return std::nullopt;
    ++ns;
  }
  return decimal->negative ? -ns : ns;
}

}  // namespace scanloc::dataset
