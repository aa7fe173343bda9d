#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace scanloc::cli {

/// One subcommand of `scanloc`: one object, used once, by one thread.
class Command {
 public:
  Command(const char* name, const char* summary) : name_(name), summary_(summary) {}
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;
  virtual ~Command() = default;

  [[nodiscard]] const std::string& name() const { return name_; }
  /// One line, for `scanloc --help`.
  [[nodiscard]] const std::string& summary() const { return summary_; }

  /// Adds the command's options, which are parsed into this object.
  virtual void Declare(CLI::App& app) = 0;

  /// What the options' own checks cannot see; not OK is wrong usage, and nothing has been done yet.
  [[nodiscard]] virtual absl::Status CheckUsage() const { return absl::OkStatus(); }

  /// Does the work. Results go to stdout, all else to stderr; not OK means that it failed.
  [[nodiscard]] virtual absl::Status Run() = 0;

 private:
  const std::string name_;
  const std::string summary_;
};

std::unique_ptr<Command> MakeSimulateCommand();
std::unique_ptr<Command> MakeBagCommand();
std::unique_ptr<Command> MakeBuildCommand();
std::unique_ptr<Command> MakeOptimizeCommand();
std::unique_ptr<Command> MakeAlignCommand();
std::unique_ptr<Command> MakeHealthCommand();
std::unique_ptr<Command> MakeInfoCommand();
std::unique_ptr<Command> MakeVerifyCommand();
std::unique_ptr<Command> MakeLocateCommand();
std::unique_ptr<Command> MakeEvalCommand();
std::unique_ptr<Command> MakeReportDiffCommand();
std::unique_ptr<Command> MakeMergeCommand();
std::unique_ptr<Command> MakeEditCommand();
std::unique_ptr<Command> MakeDiffCommand();
std::unique_ptr<Command> MakeRefreshCommand();
std::unique_ptr<Command> MakeExportCommand();
std::unique_ptr<Command> MakePlotCommand();
std::unique_ptr<Command> MakeAdminCommand();
std::unique_ptr<Command> MakePublishCommand();
std::unique_ptr<Command> MakeRollbackCommand();
std::unique_ptr<Command> MakeCatalogueCommand();

/// All of them, in the order in which the help lists them.
[[nodiscard]] std::vector<std::unique_ptr<Command>> AllCommands();

/// Takes numbers from low to high; unlike CLI::Range, not NaN.
[[nodiscard]] CLI::Validator InRange(double low, double high);

/// Takes the texts that `parse` does, by what it says.
template <typename Parse>
[[nodiscard]] auto ParsedBy(Parse parse) {
  return [parse](const std::string& text) { return std::string(parse(text).status().message()); };
}

/// So many numbers with commas between; InvalidArgument, with the form that they should have.
[[nodiscard]] absl::StatusOr<std::vector<double>> ParseNumbers(const std::string& text,
                                                               std::size_t count, const char* form);

/// Puts the options that are declared while it lives under a heading of the help.
class OptionGroup {
 public:
  OptionGroup(CLI::App& app, const std::string& name)
      : defaults_(*app.option_defaults()), before_(defaults_.get_group()) {
    defaults_.group(name);
  }
  ~OptionGroup() { defaults_.group(before_); }
  OptionGroup(const OptionGroup&) = delete;
  OptionGroup& operator=(const OptionGroup&) = delete;

 private:
  CLI::OptionDefaults& defaults_;
  const std::string before_;
};

/// Declares an option whose text `take` takes; what it refuses is wrong usage.
CLI::Option* AddParsedOption(CLI::App& app, const std::string& flag,
                             std::function<absl::Status(const std::string& text)> take,
                             const std::string& what);

/// InvalidArgument: a file that the command would replace is one that it was given to read.
[[nodiscard]] absl::Status CheckOutputs(const CLI::App& command);

/// Declares --threads, 0 for one a processor.
void AddThreadsOption(CLI::App& app, int* num_threads, const std::string& what_for);
/// Declares --quiet.
void AddQuietOption(CLI::App& app, bool* quiet);

}  // namespace scanloc::cli
