#include "pose_columns.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"

namespace scanloc::dataset {
namespace {

// In small letters, without quotes, "%" (a recorded topic's), and the unit in brackets.
std::string Normalise(std::string_view name) {
  std::string text = absl::AsciiStrToLower(ToAbsl(name.substr(0, name.find_first_of("[("))));
  std::erase_if(text, [](char c) { return c == '"' || c == '\'' || c == '%' || c == ' '; });
  return text;
}

bool IsOneOf(const std::string& name, std::initializer_list<std::string_view> names) {
  return std::ranges::find(names, name) != names.end();
}

bool IsQuaternion(const std::string& name) {
  return name.front() == 'q' || absl::StrContains(name, "quat") ||
         absl::StrContains(name, "orientation") || absl::StrContains(name, "rot");
}

bool IsPosition(const std::string& name) {
  return IsOneOf(name, {"x", "y", "z", "tx", "ty", "tz", "px", "py", "pz"}) ||
         absl::StartsWith(name, "p_") || absl::StartsWith(name, "t_") ||
         absl::StartsWith(name, "pos") || absl::StartsWith(name, "trans") ||
         absl::StrContains(name, "position") || absl::StrContains(name, "translation");
}

bool IsStamp(const std::string& name) {
  return IsOneOf(name, {"t", "ts", "stamp"}) || absl::StartsWith(name, "time");
}

// One column, or a second one of the same name, which makes neither sure.
class Column {
 public:
  void Add(std::size_t i) { ++num_, index_ = i; }
  [[nodiscard]] bool IsSure() const { return num_ == 1; }
  [[nodiscard]] std::size_t index() const { return index_; }

 private:
  std::size_t num_ = 0;
  std::size_t index_ = 0;
};

}  // namespace

std::optional<PoseColumns> ReadHeadline(const Tokens& headline) {
  constexpr std::string_view kParts = "xyzw";
  std::array<Column, 3> xyz;
  std::array<Column, 4> quaternion;
  Column stamp, seconds, nanoseconds;
  for (std::size_t i = 0; i < headline.size(); ++i) {
    const std::string name = Normalise(headline[i]);
    if (name.empty()) continue;
    const std::size_t part = kParts.find(name.back());
    if (IsOneOf(name, {"sec", "secs", "seconds"})) {
      seconds.Add(i);
    } else if (IsOneOf(name, {"nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds"})) {
      nanoseconds.Add(i);
    } else if (IsStamp(name)) {
      stamp.Add(i);
    } else if (part != std::string_view::npos && IsQuaternion(name)) {
      quaternion[part].Add(i);
    } else if (part < 3 && IsPosition(name)) {
      xyz[part].Add(i);
    }
  }
  PoseColumns columns{.num_values = headline.size()};
  for (std::size_t part = 0; part < quaternion.size(); ++part) {
    if (!quaternion[part].IsSure() || (part < 3 && !xyz[part].IsSure())) return std::nullopt;
    columns.quaternion[part] = quaternion[part].index();
    if (part < 3) columns.xyz[part] = xyz[part].index();
  }
  if (seconds.IsSure() && nanoseconds.IsSure()) {
    columns.stamp = {seconds.index(), nanoseconds.index()};
  } else if (stamp.IsSure()) {
    columns.stamp = {stamp.index()};
  }
  return columns;
}

}  // namespace scanloc::dataset
