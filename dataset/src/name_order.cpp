#include "name_order.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "decimal_time.hpp"
#include "scan_list.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

// A name in parts: text, number, text, ..., number, text.
struct Parts {
  std::vector<std::string_view> texts;  // one more than numbers
  std::vector<std::string_view> numbers;
};

Parts Split(std::string_view name) {
  std::string_view rest = Stem(name);
  Parts parts;
  while (true) {
    const std::size_t digit = std::min(rest.find_first_of("0123456789"), rest.size());
    parts.texts.push_back(rest.substr(0, digit));
    rest.remove_prefix(digit);
    if (rest.empty()) return parts;
    const std::size_t end = std::min(rest.find_first_not_of("0123456789"), rest.size());
    parts.numbers.push_back(rest.substr(0, end));
    rest.remove_prefix(end);
  }
}

std::string_view WithoutZeros(std::string_view digits) {
  return digits.substr(std::min(digits.find_first_not_of('0'), digits.size()));
}

// Leading zeros aside, a longer number is the greater one.
int CompareNumbers(std::string_view a, std::string_view b) {
  const std::string_view x = WithoutZeros(a);
  const std::string_view y = WithoutZeros(b);
  if (x.size() != y.size()) return x.size() < y.size() ? -1 : 1;
  return x.compare(y);
}

// What the digits after a decimal point are.
enum class Fraction { kNone, kDigits, kWhole, kUnclear };

class Names {
 public:
  explicit Names(const std::vector<std::string_view>& names) : names_(names) {
    for (const std::string_view name : names) parts_.push_back(Split(name));
    has_one_shape_ = std::ranges::all_of(
        parts_, [&](const Parts& parts) { return parts.texts == parts_.front().texts; });
    if (HasPair(".")) fraction_ = TellFraction();
  }

  [[nodiscard]] bool has_one_shape() const { return has_one_shape_; }
  [[nodiscard]] Fraction fraction() const { return fraction_; }

  [[nodiscard]] bool IsBefore(std::size_t a, std::size_t b) const {
    const Parts& x = parts_[a];
    const Parts& y = parts_[b];
    for (std::size_t i = 0; i < std::min(x.texts.size(), y.texts.size()); ++i) {
      if (x.texts[i] != y.texts[i]) return x.texts[i] < y.texts[i];
      if (i == x.numbers.size() || i == y.numbers.size()) continue;
      const bool is_fraction = fraction_ == Fraction::kDigits && i + 1 == x.numbers.size();
      const int sign = is_fraction ? x.numbers[i].compare(y.numbers[i])
                                   : CompareNumbers(x.numbers[i], y.numbers[i]);
      if (sign != 0) return sign < 0;
    }
    return names_[a] < names_[b];
  }

  // The only number of a name.
  [[nodiscard]] std::optional<std::int64_t> Number(std::size_t i) const {
    std::int64_t value = 0;
    const bool is_one = has_one_shape_ && parts_[i].numbers.size() == 1 &&
                        absl::SimpleAtoi(ToAbsl(parts_[i].numbers[0]), &value);
    return is_one ? std::optional(value) : std::nullopt;
  }

  // Whether the stamps of all names are seconds and whole nanoseconds.
  [[nodiscard]] bool AreWholeNanoseconds() const {
    if (!HasPair("_") && !HasPair("-") && fraction_ != Fraction::kWhole) return false;
    constexpr std::size_t kDigits = 9;
    bool is_any_long = false;
    for (const Parts& parts : parts_) {
      const auto [seconds, rest] = Pair(parts);
      if (seconds.size() > kDigits + 1 || rest.size() > kDigits) return false;
      is_any_long |= WithoutZeros(rest).size() == kDigits;
    }
    return is_any_long;
  }

  [[nodiscard]] std::optional<std::int64_t> Stamp(std::size_t i, bool whole_nanoseconds) const {
    if (!HasPair(".") && !whole_nanoseconds) return StampOfName(names_[i]);
    if (fraction_ == Fraction::kUnclear) return std::nullopt;
    const auto [seconds, rest] = Pair(parts_[i]);
    // A prefix is taken for one only before what can be a date.
    if (!parts_[i].texts.front().empty() && seconds.size() < 9) return std::nullopt;
    if (!whole_nanoseconds) {
      if (fraction_ == Fraction::kWhole) return std::nullopt;
      return ParseTimeAsNs(absl::StrCat(ToAbsl(seconds), ".", ToAbsl(rest)));
    }
    std::int64_t rest_ns = 0;
    const std::optional<std::int64_t> seconds_ns = ParseTimeAsNs(seconds);
    if (!seconds_ns || !absl::SimpleAtoi(ToAbsl(rest), &rest_ns)) return std::nullopt;
    if (*seconds_ns > std::numeric_limits<std::int64_t>::max() - rest_ns) return std::nullopt;
    return *seconds_ns + rest_ns;
  }

 private:
  // Whether names end in two numbers with this between them and nothing after.
  [[nodiscard]] bool HasPair(std::string_view between) const {
    if (!has_one_shape_ || parts_.empty() || parts_[0].numbers.size() != 2) return false;
    return parts_[0].texts[1] == between && parts_[0].texts[2].empty();
  }

  static std::pair<std::string_view, std::string_view> Pair(const Parts& parts) {
    return {parts.numbers[0], parts.numbers[1]};
  }

  // Fractions written without trailing zeros, or whole numbers written without leading ones. With
  // neither sort of zero to tell by, nine digits and many names: one fraction in ten would begin
  // with a zero.
  [[nodiscard]] Fraction TellFraction() const {
    constexpr std::size_t kMany = 50;
    bool same_length = true, any_leading = false, any_trailing = false;
    std::size_t longest = 0;
    for (const Parts& parts : parts_) {
      const std::string_view digits = Pair(parts).second;
      same_length &= digits.size() == Pair(parts_[0]).second.size();
      longest = std::max(longest, digits.size());
      any_leading |= digits.size() > 1 && digits.front() == '0';
      any_trailing |= digits.size() > 1 && digits.back() == '0';
    }
    if (same_length) return Fraction::kDigits;
    if (any_leading != any_trailing) return any_leading ? Fraction::kDigits : Fraction::kWhole;
    const bool many = parts_.size() >= kMany && longest == 9 && !any_leading;
    return many ? Fraction::kWhole : Fraction::kUnclear;
  }

  const std::vector<std::string_view>& names_;
  std::vector<Parts> parts_;
  bool has_one_shape_ = false;
  Fraction fraction_ = Fraction::kNone;
};

// Gives `values` what `value_of` gives for each name; nothing if one gives none.
template <typename ValueOf>
void CollectAll(const std::vector<std::size_t>& order, const ValueOf& value_of,
                std::vector<std::int64_t>& values) {
  for (const std::size_t i : order) {
    const std::optional<std::int64_t> value = value_of(i);
    if (!value) return values.clear();
    values.push_back(*value);
  }
}

}  // namespace

NameOrder OrderNames(const std::vector<std::string_view>& names) {
  NameOrder result;
  result.order.resize(names.size());
  std::iota(result.order.begin(), result.order.end(), 0);
  const Names all(names);
  std::ranges::sort(result.order, [&](std::size_t a, std::size_t b) { return all.IsBefore(a, b); });
  const bool whole_nanoseconds = all.AreWholeNanoseconds();
  CollectAll(
      result.order, [&](std::size_t i) { return all.Stamp(i, whole_nanoseconds); },
      result.stamps_ns);
  CollectAll(
      result.order, [&](std::size_t i) { return all.Number(i); }, result.numbers);
  if (whole_nanoseconds && !result.stamps_ns.empty()) {
    result.note = "the names of the scans are read as seconds and whole nanoseconds";
  }
  if (all.fraction() == Fraction::kUnclear) {
    result.doubt =
        "the digits after the point have different lengths and may be digits of a fraction or "
        "whole nanoseconds without leading zeros; give all nine digits";
  }
  for (std::size_t i = 1; !all.has_one_shape() && i < names.size(); ++i) {
    const std::string_view before = names[result.order[i - 1]];
    const std::string_view after = names[result.order[i]];
    if (before < after) continue;
    result.doubt = absl::StrCat(ToAbsl(before), " comes before ", ToAbsl(after),
                                " by its number but not by its letters, and the names are not all "
                                "of one shape; give their numbers leading zeros");
    break;
  }
  return result;
}

}  // namespace scanloc::dataset
