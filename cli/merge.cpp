#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "cli/calibrate.hpp"
#include "cli/command.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "cli/provenance.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/check_session.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/mapdb/merge_maps.hpp"

namespace scanloc::cli {
namespace {

class MergeCommand : public Command {
 public:
  MergeCommand() : Command("merge", "Make one map of several that share a map frame") {}
  void Declare(CLI::App& app) override {
    app.add_option("OUT", out_, "Map file to make")->required();
    app.add_option("MAPS", inputs_, "Map files, of equal parameters and in one map frame")
        ->required();
    app.add_flag("--rename-sessions", rename_sessions_,
                 "Name sessions anew whose name an earlier map has: NAME-2, NAME-3, ...");
    app.add_flag("--accept-inconsistent", accept_inconsistent_,
                 "Merge though places that several maps have stand elsewhere in each");
    AddThreadsOption(app, &num_threads_, "calibrate");
    AddQuietOption(app, &quiet_);
    app.footer(
        "Poses are taken over as they are: the maps must share one map frame. Where two\n"
        "sessions have one name, --rename-sessions gives the later another.\n"
        "Example:\n"
        "  scanloc merge town.scanloc north.scanloc south.scanloc");
  }
  [[nodiscard]] absl::Status Run() override {
    CatchInterrupts();
    std::string calibration;
    const absl::StatusOr<std::string> content_id = mapdb::MergeMaps(
        out_, inputs_, rename_sessions_,
        MadeNow(absl::StrCat("merge ", absl::StrJoin(inputs_, " "))), [&](const std::string& path) {
          RETURN_IF_ERROR(CheckFrames(path));
          return Calibrating(num_threads_, quiet_, &calibration)(path);
        });
    if (!content_id.ok()) return content_id.status();
    ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(out_));
    return WriteText("-", absl::StrFormat("merged %d maps into %s\n"
                                          "  places      %d in %d sessions\n"
                                          "  content id  %s\n%s",
                                          inputs_.size(), Printable(out_), info.num_places,
                                          info.sessions.size(), *content_id, calibration));
  }

 private:
  [[nodiscard]] absl::Status CheckFrames(const std::string& merged) const {
    if (accept_inconsistent_) return absl::OkStatus();
    std::vector<std::int64_t> num_places;
    for (const std::string& input : inputs_) {
      ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(input));
      num_places.push_back(info.num_places);
    }
    absl::Status status = mapdb::CheckParts(merged, num_places);
    if (!absl::IsInvalidArgument(status)) return status;
    return absl::InvalidArgumentError(absl::StrCat(
        status.message(), ". Nothing was written; --accept-inconsistent merges all the same"));
  }

  std::string out_;
  std::vector<std::string> inputs_;
  int num_threads_ = 0;
  bool rename_sessions_ = false;
  bool accept_inconsistent_ = false;
  bool quiet_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeMergeCommand() { return std::make_unique<MergeCommand>(); }

}  // namespace scanloc::cli
