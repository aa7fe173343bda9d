#include "text.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::string_view kBlanks = " \t\r\v\f";

bool IsBlank(char c) { return kBlanks.find(c) != std::string_view::npos; }

}  // namespace

std::optional<std::string_view> LineReader::Next() {
  if (rest_.empty()) return std::nullopt;
  const std::size_t end = rest_.find('\n');
  std::string_view line = rest_.substr(0, end);
  rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  ++line_number_;
  return line;
}

void SplitAtBlanks(std::string_view line, Tokens& tokens) {
  tokens.clear();
  std::size_t i = 0;
  while (i < line.size() && tokens.size() < kMaxTokens) {
    while (i < line.size() && IsBlank(line[i])) ++i;
    const std::size_t begin = i;
    while (i < line.size() && !IsBlank(line[i])) ++i;
    if (i > begin) tokens.push_back(line.substr(begin, i - begin));
  }
}

std::string Quote(std::string_view token) {
  constexpr std::size_t kMaxBytes = 40;
  std::string quoted = "\"";
  for (const char c : token.substr(0, kMaxBytes)) quoted += c >= ' ' && c <= '~' ? c : '?';
  quoted += token.size() > kMaxBytes ? "...\"" : "\"";
  return quoted;
}

}  // namespace scanloc::dataset
