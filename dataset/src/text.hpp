#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace scanloc::dataset {

/// Walks through the lines of a text, counting them; takes "\n" and "\r\n" ends.
class LineReader {
 public:
  /// first_line is the number of the text's first line, for messages.
  explicit LineReader(std::string_view text, std::size_t first_line = 1)
      : rest_(text), line_number_(first_line - 1) {}

  /// The next line without its end; none at the end of the text.
  std::optional<std::string_view> Next();

  /// Number of the line that Next gave last.
  [[nodiscard]] std::size_t line_number() const { return line_number_; }
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
  std::size_t line_number_;
};

/// The tokens of a line, between any number of blanks; tokens is overwritten.
void SplitAtBlanks(std::string_view line, std::vector<std::string_view>& tokens);

/// A token of untrusted text for a message: at most 40 bytes, quoted, unprintable bytes as "?".
[[nodiscard]] std::string Quote(std::string_view token);

}  // namespace scanloc::dataset
