#include "cli/command.hpp"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace scanloc::cli {

std::vector<std::unique_ptr<Command>> AllCommands() {
  std::vector<std::unique_ptr<Command>> commands;
  commands.push_back(MakeSimulateCommand());
  commands.push_back(MakeBagCommand());
  commands.push_back(MakeBuildCommand());
  commands.push_back(MakeHealthCommand());
  commands.push_back(MakeInfoCommand());
  commands.push_back(MakeVerifyCommand());
  commands.push_back(MakeLocateCommand());
  commands.push_back(MakeEvalCommand());
  commands.push_back(MakePlotCommand());
  commands.push_back(MakeMergeCommand());
  commands.push_back(MakeExportCommand());
  commands.push_back(MakeAdminCommand());
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

void AddThreadsOption(CLI::App& app, int* num_threads, const std::string& what_for) {
  app.add_option("--threads", *num_threads, "Threads that " + what_for + "; 0: one a processor")
      ->check(InRange(0, 256))
      ->capture_default_str();
}

void AddQuietOption(CLI::App& app, bool* quiet) {
  app.add_flag("--quiet", *quiet, "Show no progress");
}

}  // namespace scanloc::cli
