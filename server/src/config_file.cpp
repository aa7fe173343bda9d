#include "config_file.hpp"

#include <algorithm>
#include <sstream>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "scanloc/core/printable.hpp"

namespace scanloc::server {
namespace {

/// Of the first line that begins so, behind blanks and quotes; 0 if none does.
std::size_t LineOf(const std::vector<std::string>& lines, const std::string& begin) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::size_t start = lines[i].find_first_not_of(" \t\"'");
    if (start != std::string::npos && absl::StartsWith(lines[i].substr(start), begin)) return i + 1;
  }
  return 0;
}

}  // namespace

std::vector<CLI::ConfigItem> ConfigFile::from_config(std::istream& input) const {
  constexpr std::size_t kMostBytes = 1 << 20;  // /dev/zero has no end
  std::string text(kMostBytes, '\0');
  input.read(text.data(), kMostBytes);
  text.resize(static_cast<std::size_t>(input.gcount()));
  if (!input.eof()) {
    throw CLI::ValidationError(
        "--config", absl::StrCat("cannot be read, or has ", kMostBytes, " bytes or more"));
  }
  lines_ = absl::StrSplit(text, '\n');
  std::istringstream stream(text);
  std::vector<CLI::ConfigItem> found = CLI::ConfigTOML::from_config(stream);
  for (const CLI::ConfigItem& item : found) names_.push_back(item.fullname());
  for (const CLI::ConfigItem& item : found) Check(item);
  return found;
}

void ConfigFile::Check(const CLI::ConfigItem& item) const {
  const std::string name = absl::StrCat("--", item.fullname());
  // A flag would be taken for set by it.
  if (std::ranges::count(item.inputs, "") > 0) {
    throw CLI::ValidationError(name, "its value is empty; give one, or leave the option out");
  }
  const CLI::Option* option = app_ == nullptr ? nullptr : app_->get_option_no_throw(name);
  if (option == nullptr || option->get_expected_min() > 0) return;
  const std::string value = absl::StrJoin(item.inputs, ",");
  if (value == "true" || value == "false") return;
  throw CLI::ValidationError(
      name, absl::StrCat("its value is \"", Printable(value), "\"; it must be true or false"));
}

std::optional<std::string> ConfigFile::Explain(const CLI::ParseError& error,
                                               const std::string& path,
                                               const std::vector<std::string>& arguments) const {
  const std::string what = error.what();
  for (const std::string& name : names_) {
    const std::string flag = absl::StrCat("--", name);
    const bool is_unknown = dynamic_cast<const CLI::ConfigError*>(&error) != nullptr &&
                            absl::EndsWith(what, absl::StrCat(" ", name));
    const bool is_on_command_line =
        std::ranges::any_of(arguments, [&](const std::string& argument) {
          return argument == flag || absl::StartsWith(argument, absl::StrCat(flag, "="));
        });
    const bool is_bad = !is_on_command_line && absl::StrContains(what, flag);
    if (!is_unknown && !is_bad) continue;
    absl::string_view begin = name;
    const bool is_section = absl::ConsumeSuffix(&begin, ".++");  // as CLI11 calls its opening
    const std::size_t line = LineOf(
        lines_, is_section ? absl::StrCat("[", begin)
                           : std::string(begin.substr(begin.rfind('.') + 1)));  // npos + 1 is 0
    const std::string where = absl::StrCat(path, ":", line, ": ");
    if (is_section) return absl::StrCat(where, "there are no sections; leave out [", begin, "]");
    if (is_unknown) return absl::StrCat(where, "no option is named \"", name, "\"; see --help");
    return absl::StrCat(where, what);
  }
  return std::nullopt;
}

}  // namespace scanloc::server
