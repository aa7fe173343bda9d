#include <algorithm>
#include <string_view>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "scanloc/catalogue/catalogue.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::catalogue {
namespace {

constexpr std::size_t kContentIdDigits = 32;
constexpr std::size_t kSha256Digits = 64;
constexpr std::size_t kDigitsOfHash = 16;

bool IsHex(std::string_view text, std::size_t num_digits) {
  return text.size() == num_digits && std::ranges::all_of(text, [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

bool IsRegionName(std::string_view name) {
  return !name.empty() && name.size() <= limits::kMaxNameBytes && name.front() != '.' &&
         std::ranges::all_of(name, [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                  c == '.' || c == '_' || c == '-';
         });
}

absl::Status Bad(absl::string_view what, absl::string_view value, absl::string_view allowed) {
  return absl::InvalidArgumentError(
      absl::StrCat(what, " is '", absl::Utf8SafeCHexEscape(value), "'; it must be ", allowed));
}

}  // namespace

std::string Version::FileName() const {
  return absl::StrCat(content_id, "-", sha256.substr(0, kDigitsOfHash), ".scanloc");
}

absl::Status Validate(const Version& version) {
  if (!IsRegionName(version.region)) {
    return Bad("the region", version.region, "letters, digits, '.', '_' or '-', at most 255");
  }
  if (!IsHex(version.content_id, kContentIdDigits)) {
    return Bad("the content id", version.content_id, "32 hex digits");
  }
  if (!IsHex(version.sha256, kSha256Digits)) {
    return Bad("the hash of the file", version.sha256, "64 hex digits");
  }
  if (version.num_bytes <= 0 || version.num_places < 0) {
    return Bad("the size", absl::StrCat(version.num_bytes), "that of a map file");
  }
  RETURN_IF_ERROR(Validate(version.area));
  if (version.published_by.size() > limits::kMaxNameBytes) {
    return Bad("the publisher", version.published_by, "at most 255 bytes");
  }
  return absl::OkStatus();
}

}  // namespace scanloc::catalogue
