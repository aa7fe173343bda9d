#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cli/calibrate.hpp"
#include "cli/change_detection.hpp"
#include "cli/command.hpp"
#include "cli/drive_plan.hpp"
#include "cli/output.hpp"
#include "cli/provenance.hpp"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/edit_map.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {
namespace {

constexpr std::size_t kMaxScansAsked = 200;

/// A map of the new places, beside the one to be made; gone at the end. One of a process that was
/// killed, and had the same number, is in nobody's way.
class FreshMap {
 public:
  explicit FreshMap(const std::string& out) : path_(absl::StrCat(out, ".fresh-", getpid())) {
    Remove();
  }
  FreshMap(const FreshMap&) = delete;
  FreshMap& operator=(const FreshMap&) = delete;
  ~FreshMap() { Remove(); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  void Remove() const {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
    std::filesystem::remove(path_ + "-journal", ignored);
  }

  const std::string path_;
};

class RefreshCommand : public Command {
 public:
  RefreshCommand()
      : Command("refresh",
                "Make a new map of a map, with what has changed replaced by a new drive") {}
  void Declare(CLI::App& app) override {
    app.add_option("MAP", map_, "Map file; it stays as it is")->required();
    app.add_option("OUT", out_, "Map file to make; must not exist")->required();
    drive_.Declare(app);
    app.footer(
        "Places that the drive sees differently are left out, and its scans there come in; where\n"
        "it was not, or sees the same, the map stays. scanloc diff shows what would be done.\n"
        "Examples:\n"
        "  scanloc refresh town.scanloc new.scanloc --scans drive9 --poses drive9/poses.txt\n"
        "  scanloc refresh town.scanloc new.scanloc --scans drive9 --poses drive9/odometry.txt "
        "--align");
  }
  [[nodiscard]] absl::Status CheckUsage() const override { return drive_.CheckUsage(); }
  [[nodiscard]] absl::Status Run() override {
    std::error_code error;
    if (std::filesystem::exists(std::filesystem::symlink_status(out_, error))) {
      return absl::AlreadyExistsError(
          absl::StrCat("there is a file '", out_, "' already; remove it or choose another name"));
    }
    ASSIGN_OR_RETURN(const DetectedChanges changes, drive_.CompareWithDrive(map_));
    std::vector<bool> replaced;
    for (const slam::Comparison& comparison : changes.of_before) {
      replaced.push_back(comparison.change == slam::Change::kChanged);
    }
    const auto is_changed = [](const slam::Comparison& c) {
      return c.change == slam::Change::kChanged;
    };
    const auto num_in = std::ranges::count_if(changes.of_after, is_changed);
    const auto num_out = std::ranges::count(replaced, true);
    if (num_in == 0 || num_out == 0) {
      return WriteText("-", absl::StrFormat("%s sees nothing else than %s: no map was made\n",
                                            Printable(changes.after_name), Printable(map_)));
    }
    ASSIGN_OR_RETURN(const std::string before, Recall(map_, changes));
    const FreshMap fresh(out_);
    RETURN_IF_ERROR(BuildFresh(changes, fresh.path()));
    std::string calibration;
    ASSIGN_OR_RETURN(
        const std::string content_id,
        mapdb::ReplacePlaces(map_, replaced, fresh.path(), out_,
                             MadeNow(absl::StrCat("refresh by ", changes.after_name)),
                             Calibrating(drive_.num_threads(), drive_.quiet(), &calibration)));
    ASSIGN_OR_RETURN(const std::string after, Recall(out_, changes));
    return WriteText("-", absl::StrFormat("refreshed %s into %s\n"
                                          "  replaced    %d of %d places, by %d scans of %s\n"
                                          "  content id  %s\n%s"
                                          "  before      %s\n"
                                          "  after       %s\n",
                                          Printable(map_), Printable(out_), num_out,
                                          replaced.size(), num_in, Printable(changes.after_name),
                                          content_id, calibration, before, after));
  }

 private:
  /// The scans of the drive that come in, as a map of its own.
  [[nodiscard]] absl::Status BuildFresh(const DetectedChanges& changes,
                                        const std::string& path) const {
    ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(map_));
    mapdb::SessionPlan plan{.name = changes.plan.name, .scans = {}};
    std::vector<std::size_t> numbers;
    for (std::size_t k = 0; k < changes.after.size(); ++k) {
      if (changes.of_after[k].change != slam::Change::kChanged) continue;
      numbers.push_back(changes.scans[k]);
      plan.scans.push_back(changes.plan.scans[changes.scans[k]]);
    }
    const mapdb::ScanLoader load_scan = LoaderOf(changes.frames, drive_.mount());
    return mapdb::BuildMap(
               {.path = path, .params = info.params, .num_threads = drive_.num_threads()}, plan,
               [&](std::size_t i) { return load_scan(numbers[i]); })
        .status();
  }
  /// One line: how many scans of the drive are found in a map.
  [[nodiscard]] absl::StatusOr<std::string> Recall(const std::string& path,
                                                   const DetectedChanges& changes) const {
    ASSIGN_OR_RETURN(Map map, mapdb::LoadMap(path));
    ASSIGN_OR_RETURN(Describer describer, Describer::Create(map.params));
    ASSIGN_OR_RETURN(const auto localizer,
                     Localizer::Create(std::make_shared<const Map>(std::move(map))));
    const mapdb::ScanLoader load_scan = LoaderOf(changes.frames, drive_.mount());
    const std::size_t num_asked = std::min(changes.frames.size(), kMaxScansAsked);
    std::size_t num_right = 0;
    std::size_t num_false = 0;
    for (std::size_t k = 0; k < num_asked; ++k) {
      const std::size_t i = k * changes.frames.size() / num_asked;
      const absl::StatusOr<PointCloud> scan = load_scan(i);
      if (absl::IsCancelled(scan.status())) return scan.status();
      if (!scan.ok()) continue;
      ASSIGN_OR_RETURN(const Answer answer, localizer->Localize(describer.Describe(*scan)));
      if (answer.outcome != Outcome::kLocalized) continue;
      const PoseDifference difference =
          DifferenceOf(answer.candidates.front().T_map_query, changes.plan.scans[i].T_map_place);
      (MissOf(difference).any() ? num_false : num_right) += 1;
    }
    return absl::StrFormat("%d of %d scans of the drive are found, %d elsewhere", num_right,
                           num_asked, num_false);
  }

  std::string map_;
  std::string out_;
  ComparedDrive drive_;
};

}  // namespace

std::unique_ptr<Command> MakeRefreshCommand() { return std::make_unique<RefreshCommand>(); }

}  // namespace scanloc::cli
