#include "decimal_time.hpp"

#include <algorithm>
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
  if (decimal.digits.empty() ||
      !std::all_of(decimal.digits.begin(), decimal.digits.end(), IsDigit)) {
    return std::nullopt;
  }
  return decimal;
}

}  // namespace

std::optional<std::int64_t> ParseSecondsAsNs(std::string_view text) {
  const std::optional<Decimal> decimal = ParseDecimal(text);
  if (!decimal) return std::nullopt;
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  const int num_digits = decimal->point + 9;  // of the nanoseconds
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
