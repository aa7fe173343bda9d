#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "cli/command.hpp"
#include "cli/output.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {
namespace {

class VerifyCommand : public Command {
 public:
  [[nodiscard]] std::string name() const override { return "verify"; }
  [[nodiscard]] std::string summary() const override {
    return "Check every page, checksum and invariant of a map file";
  }
  void Declare(CLI::App& app) override {
    app.add_option("MAP", map_, "Map file")->required();
    app.footer(
        "Prints \"MAP is sound\", or a line for each damage and ends with status 1.\n"
        "Example:\n"
        "  scanloc verify town.scanloc && scp town.scanloc robot:");
  }
  [[nodiscard]] absl::Status Run() override {
    const absl::StatusOr<std::vector<std::string>> problems = mapdb::Verify(map_);
    if (!problems.ok()) return problems.status();
    if (problems->empty()) return WriteText("-", absl::StrCat(map_, " is sound\n"));
    if (absl::Status s = WriteText("-", absl::StrCat(absl::StrJoin(*problems, "\n"), "\n"));
        !s.ok()) {
      return s;
    }
    return absl::DataLossError(absl::StrCat(
        map_, " is damaged: ", problems->size(), problems->size() == 1 ? " problem" : " problems",
        problems->size() == mapdb::kMaxProblems ? " or more" : "",
        ", listed on standard output; take a copy of the map or build it again"));
  }

 private:
  std::string map_;
};

}  // namespace

std::unique_ptr<Command> MakeVerifyCommand() { return std::make_unique<VerifyCommand>(); }

}  // namespace scanloc::cli
