#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <map>
#include <memory>
#include <new>
#include <sstream>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "cli/declared_options.hpp"
#include "cli/output.hpp"
#include "scanloc/core/printable.hpp"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace {

using scanloc::cli::Command;

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;

// What a query gives back is there for the next one: by default most of it goes to the system and
// is asked for again, where no scan was large.
void KeepFreedMemory() {
#ifdef __GLIBC__
  constexpr int kMaxFreeEndBytes = 8 << 20;
  constexpr int kMaxKeptBlockBytes = 4 << 20;
  mallopt(M_TRIM_THRESHOLD, kMaxFreeEndBytes);
  mallopt(M_MMAP_THRESHOLD, kMaxKeptBlockBytes);
#endif
}

// Always one line, so that whoever reads a log can count on it.
int Complain(const std::string& who, std::string message, int exit_status) {
  std::ranges::replace(message, '\n', ' ');
  std::fprintf(stderr, "%s: %s\n", who.c_str(), scanloc::Printable(message).c_str());
  return exit_status;
}

int Complain(const std::string& who, const absl::Status& status, int exit_status) {
  return Complain(who, absl::StrCat(status.message()), exit_status);
}

// Help and version are errors to CLI11, too.
int HandleParseError(const CLI::App& app, const std::string& who, const CLI::ParseError& error) {
  std::ostringstream out;
  std::ostringstream err;
  if (app.exit(error, out, err) == kDone) {
    const absl::Status written = scanloc::cli::WriteText("-", out.str());
    return written.ok() ? kDone : Complain(who, written, kFailed);
  }
  return Complain(who, std::string(error.what()) + "; see " + who + " --help", kWrongUsage);
}

int RunCommand(Command& command, const CLI::App& options, const std::string& who) {
  absl::Status usage = command.CheckUsage();
  usage.Update(scanloc::cli::CheckOutputs(options));
  if (!usage.ok()) {
    return Complain(who, absl::StrCat(usage.message(), "; see ", who, " --help"), kWrongUsage);
  }
  try {
    const absl::Status status = command.Run();
    return status.ok() ? kDone : Complain(who, status, kFailed);
  } catch (const std::bad_alloc&) {
    return Complain(who, "out of memory", kFailed);
  } catch (const std::exception& error) {
    return Complain(who, std::string("unexpected error: ") + error.what(), kFailed);
  }
}

}  // namespace

int main(int argc, char** argv) {
  KeepFreedMemory();
  scanloc::cli::PrepareStandardStreams();
  CLI::App app(
      "Tells a robot that wakes up anywhere in a mapped town where it is, from one LiDAR "
      "scan.",
      "scanloc");
  app.set_version_flag("--version", "scanloc " SCANLOC_VERSION);
  app.require_subcommand(1);
  app.footer(
      "A first map and a first answer, without any data:\n"
      "  scanloc simulate drive1 --session-seed 1 --length-m 400\n"
      "  scanloc simulate drive2 --session-seed 2 --length-m 400 --reverse\n"
      "  scanloc build town.scanloc --scans drive1 --poses drive1/poses.txt\n"
      "  scanloc locate town.scanloc --scans drive2 --truth drive2/poses.txt\n"
      "Exit status: 0 done, 1 failed, 2 wrong usage.");

  const std::vector<std::unique_ptr<Command>> commands = scanloc::cli::AllCommands();
  std::map<std::string, Command*> command_named;
  for (const std::unique_ptr<Command>& command : commands) {
    CLI::App* declared = app.add_subcommand(command->name(), command->summary());
    command->Declare(*declared);
    scanloc::cli::ShowDefaults(*declared);
    scanloc::cli::RefuseEmptyValues(*declared);
    command_named[command->name()] = command.get();
  }
  std::string who = "scanloc";
  if (argc > 1 && argv[1][0] != '-' && !command_named.contains(argv[1])) {
    return Complain(who, std::string("there is no command \"") + argv[1] + "\"; see scanloc --help",
                    kWrongUsage);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (!app.get_subcommands().empty()) who += " " + app.get_subcommands().front()->get_name();
    return HandleParseError(app, who, error);
  }
  const CLI::App* chosen = app.get_subcommands().front();
  return RunCommand(*command_named[chosen->get_name()], *chosen, who + " " + chosen->get_name());
}
