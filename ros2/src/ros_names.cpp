#include "ros_names.hpp"

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace scanloc::ros2 {
namespace {

/// Whether every part after a "/" is a name.
bool IsAbsoluteName(std::string_view name) {
  char before = '\0';
  for (const char c : name) {
    const bool is_word = absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_';
    if (!is_word && c != '/') return false;
    if (before == '/' && (c == '/' || absl::ascii_isdigit(static_cast<unsigned char>(c)))) {
      return false;
    }
    before = c;
  }
  return name.size() > 1 && name.front() == '/' && before != '/';
}

}  // namespace

absl::StatusOr<std::string> DdsTopicName(const std::string& ros_namespace,
                                         const std::string& topic) {
  std::string name = topic;
  if (!topic.starts_with('/')) {
    const char* const slash = ros_namespace.starts_with('/') ? "" : "/";
    name = absl::StrCat(slash, ros_namespace, ros_namespace.ends_with('/') ? "" : "/", topic);
    if (ros_namespace.empty()) name = absl::StrCat("/", topic);
  }
  constexpr std::size_t kMaxBytes = 247;  // as ROS 2 has it
  if (!IsAbsoluteName(name) || name.size() > kMaxBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", absl::Utf8SafeCHexEscape(name),
                     "\" is no name of a topic: letters, digits and \"_\", no digit first, parted "
                     "by \"/\", at most ",
                     kMaxBytes, " characters"));
  }
  return absl::StrCat("rt", name);
}

}  // namespace scanloc::ros2
