#include <CLI/CLI.hpp>

#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "cli/drive_plan.hpp"
#include "cli/interrupt.hpp"
#include "cli/param_options.hpp"
#include "cli/slam_options.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/learn_scale.hpp"

namespace scanloc::cli {
namespace {

class OptimizeCommand : public Command {
 public:
  OptimizeCommand()
      : Command("optimize", "Close the loops of a drive: odometry in, poses that agree out") {}
  void Declare(CLI::App& app) override {
    slam_.Declare(app);
    params_.Declare(app);
    app.footer(
        "Scans are compared with all earlier ones; what is found becomes a pose graph with the\n"
        "odometry, in which wrong loops are switched off. The first pose stays where it is.\n"
        "Examples:\n"
        "  scanloc optimize --scans drive1 --poses drive1/odometry.txt --out closed.txt\n"
        "  scanloc optimize --bag drive.mcap --poses-from /odom --out closed.tum --report report\n"
        "  scanloc optimize --scans 00 --poses lo.txt --truth 00.txt --out 00.txt --out 00.g2o");
  }
  [[nodiscard]] absl::Status CheckUsage() const override {
    RETURN_IF_ERROR(slam_.CheckUsage());
    return params_.Make().status();
  }
  [[nodiscard]] absl::Status Run() override {
    CatchInterrupts();
    ASSIGN_OR_RETURN(const SlamOptions::Drive drive, slam_.Open());
    const mapdb::ScanLoader load_scan = LoaderOf(drive.frames, slam_.mount());
    ASSIGN_OR_RETURN(Params params, params_.Make());
    if (params_.learns_scale() && params.structure.enabled) {
      ASSIGN_OR_RETURN(const double scale, mapdb::LearnScale(params, drive.plan, load_scan));
      params.automatic = AutoParamsAtScale(scale);
    }
    StageProgress progress(slam_.quiet());
    const absl::StatusOr<slam::ClosedDrive> closed =
        slam::CloseLoops(params, drive.plan, load_scan, slam_.MakeOptions(progress));
    progress.Clear();
    if (!closed.ok()) return closed.status();
    return slam_.Tell(absl::StrCat("loops of ", drive.plan.name), drive, *closed);
  }

 private:
  SlamOptions slam_;
  ParamOptions params_;
};

}  // namespace

std::unique_ptr<Command> MakeOptimizeCommand() { return std::make_unique<OptimizeCommand>(); }

}  // namespace scanloc::cli
