#include "http_parts.hpp"

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/report/json.hpp"

namespace scanloc::web {
namespace {

constexpr std::size_t kMaxParameters = 32;

int Digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

absl::StatusOr<std::string> Unescape(absl::string_view text, bool plus_is_space) {
  std::string plain;
  plain.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '+' && plus_is_space) {
      plain += ' ';
    } else if (text[i] != '%') {
      plain += text[i];
    } else {
      const int high = i + 2 < text.size() ? Digit(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? Digit(text[i + 2]) : -1;
      if (high < 0 || low < 0) {
        return absl::InvalidArgumentError("the URL has a % without two hexadecimal digits");
      }
      plain += static_cast<char>(high * 16 + low);
      i += 2;
    }
  }
  if (plain.find('\0') != std::string::npos) {
    return absl::InvalidArgumentError("the URL has a zero byte");
  }
  for (std::string_view rest = plain; !rest.empty();) {
    const std::size_t num_bytes = FirstUtf8Character(rest).num_bytes;
    if (num_bytes == 0) return absl::InvalidArgumentError("the URL is not UTF-8 text");
    rest.remove_prefix(num_bytes);
  }
  return plain;
}

}  // namespace

absl::Status ParseTarget(std::string_view target, Request* request) {
  const std::pair<absl::string_view, absl::string_view> parts =
      absl::StrSplit(absl::string_view(target.data(), target.size()), absl::MaxSplits('?', 1));
  if (!absl::StartsWith(parts.first, "/")) {
    return absl::InvalidArgumentError("the URL is not a path");
  }
  ASSIGN_OR_RETURN(request->path, Unescape(parts.first, false));
  if (parts.second.empty()) return absl::OkStatus();
  for (const absl::string_view piece : absl::StrSplit(parts.second, '&')) {
    const std::pair<absl::string_view, absl::string_view> pair =
        absl::StrSplit(piece, absl::MaxSplits('=', 1));
    auto name = Unescape(pair.first, true);
    auto value = Unescape(pair.second, true);
    if (!name.ok()) return name.status();
    if (!value.ok()) return value.status();
    if (request->parameters.size() == kMaxParameters) {
      return absl::InvalidArgumentError(
          absl::StrCat("the URL has more than ", kMaxParameters, " parameters"));
    }
    request->parameters.emplace_back(*std::move(name), *std::move(value));
  }
  return absl::OkStatus();
}

std::string HostOf(std::string_view header) {
  if (!header.empty() && header.front() == '[') {
    return std::string(header.substr(1, header.find(']') - 1));
  }
  return std::string(header.substr(0, header.rfind(':')));
}

Response ErrorResponse(int status, std::string_view code, std::string_view message) {
  const report::Json json{
      {"error", {{"code", std::string(code)}, {"message", Printable(message)}}}};
  return {.status = status, .body = report::ToText(json)};
}

}  // namespace scanloc::web
