#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace scanloc {

/// The text as it may be shown on a terminal or in a line of a log, wherever it comes from (a file,
/// a map, the network): what would steer a terminal, start a line of its own, be invisible or turn
/// the direction of reading is written as an escape.
///
/// Escaped are control characters (as \n, \t, \x1b or \u0085), bytes that are not UTF-8 (\xff),
/// line separators, and characters without width or that set the direction (\u202e, \U000e0001).
/// All else stays, backslashes included: what has been escaped once stays as it is.
[[nodiscard]] std::string Printable(std::string_view text);

/// One character of a UTF-8 text.
struct Utf8Character {
  char32_t code = 0;
  std::size_t num_bytes = 0;  ///< 0: the text does not begin with a character
};
/// The character at the front of the text.
[[nodiscard]] Utf8Character FirstUtf8Character(std::string_view text);

}  // namespace scanloc
