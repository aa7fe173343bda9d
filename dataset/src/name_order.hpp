#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace scanloc::dataset {

/// What the names of a folder's scans say together.
struct NameOrder {
  std::vector<std::size_t> order;       ///< indices of the names, in natural order
  std::string doubt;                    ///< why another order may be meant; empty: none may
  std::vector<std::int64_t> stamps_ns;  ///< in that order; empty unless all names give one
  std::vector<std::int64_t> numbers;    ///< likewise, the only number in each
  std::string note;                     ///< how stamps were read, where that is not plain
};

/// Orders names naturally: the numbers in them count as numbers, what stands between by its bytes.
///
/// That is doubtful, for pairing by order, if it differs from the order of bytes and the names are
/// not of one shape (the same text around the numbers), or if what follows a decimal point has
/// different lengths and may be digits of a fraction (1.5 = 1.50) or whole nanoseconds without
/// leading zeros (1.5 < 1.50). The latter shows by digits: a fraction may begin with 0 and does not
/// end with it, nanoseconds the other way round.
///
/// Stamps are 19 digits [ns], 16 digits [us], seconds with a decimal point, or seconds and, after
/// "_", "-" or a point, whole nanoseconds; the latter are told from a counter by one of 9 digits.
[[nodiscard]] NameOrder OrderNames(const std::vector<std::string_view>& names);

}  // namespace scanloc::dataset
