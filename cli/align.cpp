#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "cli/drive_plan.hpp"
#include "cli/interrupt.hpp"
#include "cli/slam_options.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/slam/align_drive.hpp"

namespace scanloc::cli {
namespace {

class AlignCommand : public Command {
 public:
  AlignCommand()
      : Command("align", "Bring a drive with odometry of its own into the frame of a map") {}
  void Declare(CLI::App& app) override {
    app.add_option("MAP", map_, "Map file")->required();
    slam_.Declare(app);
    app.footer(
        "Scans are looked up in the map and compared with each other; all that is found becomes a\n"
        "pose graph with the odometry, in which what is wrong is switched off: the drift is taken\n"
        "out on the way. A drive that shares nothing with the map is refused.\n"
        "Examples:\n"
        "  scanloc align town.scanloc --scans drive2 --poses drive2/odometry.txt --out drive2.txt\n"
        "  scanloc build town.scanloc --scans drive2 --poses drive2.txt --append\n"
        "  scanloc build town.scanloc --scans drive2 --poses drive2/odometry.txt --append --align "
        "  (both in one)");
  }
  [[nodiscard]] absl::Status CheckUsage() const override { return slam_.CheckUsage(); }
  [[nodiscard]] absl::Status Run() override {
    CatchInterrupts();
    ASSIGN_OR_RETURN(Map map, mapdb::LoadMap(map_));
    ASSIGN_OR_RETURN(const SlamOptions::Drive drive, slam_.Open());
    StageProgress progress(slam_.quiet());
    const absl::StatusOr<slam::ClosedDrive> aligned =
        slam::AlignDrive(std::make_shared<const Map>(std::move(map)), drive.plan,
                         LoaderOf(drive.frames, slam_.mount()), slam_.MakeOptions(progress));
    progress.Clear();
    if (!aligned.ok()) return aligned.status();
    return slam_.Tell(absl::StrCat(drive.plan.name, " in ", map_), drive, *aligned);
  }

 private:
  std::string map_;
  SlamOptions slam_;
};

}  // namespace

std::unique_ptr<Command> MakeAlignCommand() { return std::make_unique<AlignCommand>(); }

}  // namespace scanloc::cli
