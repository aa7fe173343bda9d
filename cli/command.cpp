#include "cli/command.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"

namespace scanloc::cli {

std::vector<std::unique_ptr<Command>> AllCommands() {
  std::vector<std::unique_ptr<Command>> commands;
  for (auto* make :
       {&MakeSimulateCommand, &MakeBagCommand,    &MakeBuildCommand,      &MakeOptimizeCommand,
        &MakeAlignCommand,    &MakeHealthCommand, &MakeInfoCommand,       &MakeVerifyCommand,
        &MakeLocateCommand,   &MakeEvalCommand,   &MakeReportDiffCommand, &MakePlotCommand,
        &MakeMergeCommand,    &MakeEditCommand,   &MakeDiffCommand,       &MakeRefreshCommand,
        &MakeExportCommand,   &MakeAdminCommand,  &MakePublishCommand,    &MakeRollbackCommand,
        &MakeCatalogueCommand}) {
    commands.push_back(make());
  }
  return commands;
}

CLI::Validator InRange(double low, double high) {
  const std::string range = absl::StrFormat("[%.12g, %.12g]", low, high);
  return CLI::Validator(
      [=](const std::string& text) {
        double value = 0.0;
        const bool in_range = absl::SimpleAtod(text, &value) && value >= low && value <= high;
        return in_range ? std::string() : absl::StrCat(text, " is no number in ", range);
      },
      absl::StrCat("in ", range));
}

absl::StatusOr<std::vector<double>> ParseNumbers(const std::string& text, std::size_t count,
                                                 const char* form) {
  std::vector<double> numbers;
  for (const absl::string_view part : absl::StrSplit(text, ',')) {
    double number = 0.0;
    if (!absl::SimpleAtod(part, &number)) break;
    numbers.push_back(number);
  }
  const auto num_commas = static_cast<std::size_t>(std::ranges::count(text, ','));
  if (numbers.size() == count && num_commas + 1 == count) return numbers;
  return absl::InvalidArgumentError(
      absl::StrCat("\"", text, "\" is not ", form, ": ", count, " numbers with commas between"));
}

CLI::Option* AddParsedOption(CLI::App& app, const std::string& flag,
                             std::function<absl::Status(const std::string& text)> take,
                             const std::string& what) {
  return app.add_option_function<std::string>(
      flag,
      [flag, take = std::move(take)](const std::string& text) {
        const absl::Status status = take(text);
        if (!status.ok()) throw CLI::ValidationError(flag, std::string(status.message()));
      },
      what);
}

absl::Status CheckOutputs(const CLI::App& command) {
  for (const char* name : {"--out", "--csv", "--geojson", "--picture"}) {
    const CLI::Option* output = command.get_option_no_throw(name);
    if (output == nullptr) continue;
    for (const CLI::Option* other : command.get_options()) {
      if (other == output) continue;
      for (const std::string& path : output->results()) {
        for (const std::string& given : other->results()) {
          std::error_code error;  // of what is no path
          if (!std::filesystem::equivalent(path, given, error)) continue;
          return absl::InvalidArgumentError(absl::StrCat(name, " would replace ", path,
                                                         ", which is given as ", other->get_name(),
                                                         ", too; choose another name"));
        }
      }
    }
  }
  return absl::OkStatus();
}

void AddThreadsOption(CLI::App& app, int* num_threads, const std::string& what_for) {
  app.add_option("--threads", *num_threads, "Threads that " + what_for + "; 0: one a processor")
      ->check(InRange(0, 256));
}

void AddQuietOption(CLI::App& app, bool* quiet) {
  app.add_flag("--quiet", *quiet, "Show no progress");
}

}  // namespace scanloc::cli
