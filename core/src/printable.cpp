#include "scanloc/core/printable.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#include "absl/strings/str_format.h"

namespace scanloc {
namespace {

struct Range {
  char32_t first;
  char32_t last;
};

// Beside ASCII's: what Unicode names controls, format characters that cannot be seen or turn the
// direction of reading, and separators of lines.
constexpr std::array<Range, 13> kUnprintable = {{{0x0080, 0x009f},
                                                 {0x00ad, 0x00ad},
                                                 {0x034f, 0x034f},
                                                 {0x061c, 0x061c},
                                                 {0x115f, 0x1160},
                                                 {0x180b, 0x180f},
                                                 {0x200b, 0x200f},
                                                 {0x2028, 0x202e},
                                                 {0x2060, 0x206f},
                                                 {0x3164, 0x3164},
                                                 {0xfeff, 0xfeff},
                                                 {0xfff0, 0xfffb},
                                                 {0xe0000, 0xe0fff}}};

bool IsPrintable(char32_t code) {
  if (code < 0x7f) return code >= 0x20;
  return code != 0x7f &&
         std::none_of(kUnprintable.begin(), kUnprintable.end(), [&](const Range& range) {
           return code >= range.first && code <= range.last;
         });
}

std::string Escape(char32_t code) {
  switch (code) {
    case '\n':
      return "\\n";
    case '\r':
      return "\\r";
    case '\t':
      return "\\t";
    default:
      return code < 0x80      ? absl::StrFormat("\\x%02x", static_cast<std::uint32_t>(code))
             : code < 0x10000 ? absl::StrFormat("\\u%04x", static_cast<std::uint32_t>(code))
                              : absl::StrFormat("\\U%08x", static_cast<std::uint32_t>(code));
  }
}

}  // namespace

std::string Printable(std::string_view text) {
  std::string printable;
  printable.reserve(text.size());
  while (!text.empty()) {
    const auto [code, num_bytes] = FirstUtf8Character(text);
    if (num_bytes == 0) {
      absl::StrAppendFormat(&printable, "\\x%02x", static_cast<std::uint8_t>(text.front()));
    } else if (IsPrintable(code)) {
      printable += text.substr(0, num_bytes);
    } else {
      printable += Escape(code);
    }
    text.remove_prefix(std::max<std::size_t>(num_bytes, 1));
  }
  return printable;
}

Utf8Character FirstUtf8Character(std::string_view text) {
  if (text.empty()) return {};
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  if (byte(0) < 0x80) return {byte(0), 1};
  const std::size_t length = byte(0) < 0xc2   ? 0
                             : byte(0) < 0xe0 ? 2
                             : byte(0) < 0xf0 ? 3
                             : byte(0) < 0xf5 ? 4
                                              : 0;
  if (length == 0 || text.size() < length) return {};
  char32_t code = byte(0) & (0x7fU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return {};
    code = code << 6 | (byte(i) & 0x3fU);
  }
  constexpr std::array<char32_t, 5> kShortest = {0, 0, 0x80, 0x800, 0x10000};
  const bool is_surrogate = code >= 0xd800 && code < 0xe000;
  if (code < kShortest[length] || code > 0x10ffff || is_surrogate) return {};
  return {code, length};
}

}  // namespace scanloc
