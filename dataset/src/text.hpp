#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace scanloc::dataset {

/// Walks through the lines of a text, counting them; takes "\n" and "\r\n" ends, and passes over
/// the mark (BOM) that Windows puts before UTF-8.
class LineReader {
 public:
  /// first_line is the number of the text's first line, for messages.
  explicit LineReader(std::string_view text, std::size_t first_line = 1)
      : rest_(text), line_number_(first_line - 1) {
    if (rest_.substr(0, 3) == "\xEF\xBB\xBF") rest_.remove_prefix(3);
  }

  /// The next line without its end; none at the end of the text.
  std::optional<std::string_view> Next();

  /// Number of the line that Next gave last.
  [[nodiscard]] std::size_t line_number() const { return line_number_; }
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
  std::size_t line_number_;
};

/// Most tokens that a line is split into; more than any format reads.
inline constexpr std::size_t kMaxTokens = 100'000;

using Tokens = std::vector<std::string_view>;

/// The first kMaxTokens tokens of a line, between any number of blanks; tokens is overwritten.
void SplitAtBlanks(std::string_view line, Tokens& tokens);

/// The same text for absl, whose string_view is a type of its own in Debian 12.
inline absl::string_view ToAbsl(std::string_view text) { return {text.data(), text.size()}; }

[[nodiscard]] inline absl::Status Invalid(std::string_view reason) {
  return absl::InvalidArgumentError(ToAbsl(reason));
}

/// A token of untrusted text for a message: at most 40 bytes, quoted, unprintable bytes as "?".
[[nodiscard]] std::string Quote(std::string_view token);

}  // namespace scanloc::dataset
