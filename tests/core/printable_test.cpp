#include "scanloc/core/printable.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace scanloc {
namespace {

using std::string_literals::operator""s;

TEST(Printable, LeavesTextAsItIs) {
  for (const std::string& text :
       {""s, "town.scanloc"s, "a \"quoted\" name, with comma"s, "C:\\maps\\x1b"s,
        "Zürich, 東京, Αθήνα"s, "\U0001f697"s, "~ and space "s}) {
    EXPECT_EQ(Printable(text), text);
  }
}

TEST(Printable, EscapesWhatIsNotForReading) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"a\nb", "a\\nb"},
      {"a\r\tb", "a\\r\\tb"},
      {"\x1b[2J", "\\x1b[2J"},
      {"nul\0!"s, "nul\\x00!"},
      {"\x7f", "\\x7f"},
      {"\u009b31m", "\\u009b31m"},          // CSI as one character
      {"\x9b\x33m", "\\x9b3m"},             // and as a byte of Latin-1
      {"\u202egnp.exe", "\\u202egnp.exe"},  // right-to-left override
      {"\u2066\u2069", "\\u2066\\u2069"},
      {"a\u2028b", "a\\u2028b"},
      {"a\u200bb\ufeff", "a\\u200bb\\ufeff"},
      {"\U000e0041", "\\U000e0041"},
      {"\xff\xfe", "\\xff\\xfe"},
      {"\xc0\x80", "\\xc0\\x80"},           // longer than needed
      {"\xed\xa0\x80", "\\xed\\xa0\\x80"},  // half of a surrogate pair
      {"\xf4\x90\x80\x80", "\\xf4\\x90\\x80\\x80"},
      {"cut \xe2\x82", "cut \\xe2\\x82"},
  };
  for (const auto& [text, expected] : cases) EXPECT_EQ(Printable(text), expected);
}

TEST(Printable, LeavesWhatItHasEscaped) {
  std::string all;
  for (int byte = 0; byte < 256; ++byte) all += static_cast<char>(byte);
  const std::string once = Printable(all + "\u202e\u2028");
  EXPECT_EQ(Printable(once), once);
}

}  // namespace
}  // namespace scanloc
