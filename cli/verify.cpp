#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "cli/map_text.hpp"
#include "cli/output.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {
namespace {

class VerifyCommand : public Command {
 public:
  VerifyCommand() : Command("verify", "Check every page, checksum and invariant of a map file") {}
  void Declare(CLI::App& app) override {
    app.add_option("MAP", map_, "Map file")->required();
    app.add_flag("--recover", recover_,
                 "First undo the unfinished write that a killed build left beside the map; where "
                 "the map is sound without that, only its leftover is removed");
    app.footer(
        "Prints \"MAP is sound\", with how far it is if its build was stopped, or a line for each "
        "damage and ends with status 1. Without\n"
        "--recover nothing is written.\n"
        "Example:\n"
        "  scanloc verify town.scanloc && scp town.scanloc robot:");
  }
  [[nodiscard]] absl::Status Run() override {
    if (recover_) {
      RETURN_IF_ERROR(Recover());
    }
    ASSIGN_OR_RETURN(const std::vector<std::string> problems, mapdb::FindProblems(map_));
    if (problems.empty()) return TellSound();
    std::string text;
    for (const std::string& problem : problems) absl::StrAppend(&text, Printable(problem), "\n");
    RETURN_IF_ERROR(WriteText("-", text));
    return absl::DataLossError(absl::StrCat(
        map_, " is damaged: ", problems.size(), problems.size() == 1 ? " problem" : " problems",
        problems.size() == mapdb::kMaxProblems ? " or more" : "",
        ", listed on standard output; take a copy of the map or build it again"));
  }

 private:
  [[nodiscard]] absl::Status TellSound() const {
    ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(map_));
    return WriteText("-",
                     absl::StrCat(Printable(map_), " is sound",
                                  info.complete ? "" : absl::StrCat("; ", HalfBuilt(info)), "\n"));
  }

  [[nodiscard]] absl::Status Recover() const {
    ASSIGN_OR_RETURN(const mapdb::Recovery recovery, mapdb::RecoverMap(map_));
    switch (recovery) {
      case mapdb::Recovery::kNothingToDo:
        return absl::OkStatus();
      case mapdb::Recovery::kRolledBack:
        return WriteText("-", "an unfinished write was undone\n");
      case mapdb::Recovery::kJournalRemoved:
        return WriteText("-", "a journal was removed that the map has no need of\n");
    }
    return absl::OkStatus();
  }

  std::string map_;
  bool recover_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeVerifyCommand() { return std::make_unique<VerifyCommand>(); }

}  // namespace scanloc::cli
