#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cli/calibrate.hpp"
#include "cli/command.hpp"
#include "cli/edit_options.hpp"
#include "cli/geo_options.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "cli/provenance.hpp"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {
namespace {

/// Places left out that are asked for again.
constexpr std::size_t kMaxAsked = 200;

/// How many of the places that thinning left out are found again, in a map without them.
class ThinningCost {
 public:
  ThinningCost(const mapdb::EditPlan& before, const mapdb::EditPlan& after) {
    std::vector<bool> stays;
    const auto mark = [&](const mapdb::EditPlan& plan, bool value) {
      for (const mapdb::EditedPlace& place : plan.places) {
        stays.resize(std::max(stays.size(), place.place + 1), true);
        stays[place.place] = value;
      }
    };
    mark(before, false);
    mark(after, true);
    std::vector<mapdb::EditedPlace> left_out;
    for (const mapdb::EditedPlace& place : before.places) {
      if (!stays[place.place]) left_out.push_back(place);
    }
    const std::size_t num_asked = std::min(left_out.size(), kMaxAsked);
    for (std::size_t k = 0; k < num_asked; ++k) {
      asked_.push_back(left_out[k * left_out.size() / num_asked]);
    }
  }

  [[nodiscard]] absl::StatusOr<std::string> Measure(const std::string& in,
                                                    const std::string& out) const {
    if (asked_.empty()) return "  recall      thinning left out no place\n";
    ASSIGN_OR_RETURN(Map map, mapdb::LoadMap(out));
    ASSIGN_OR_RETURN(const auto localizer,
                     Localizer::Create(std::make_shared<const Map>(std::move(map))));
    std::size_t next = 0;
    std::size_t num_right = 0;
    std::size_t num_false = 0;
    const absl::Status visited = mapdb::VisitDescriptors(
        in, [&](std::size_t place, const PlaceDescriptor& descriptor) -> absl::Status {
          if (next == asked_.size() || asked_[next].place != place) return absl::OkStatus();
          const Pose& truth = asked_[next++].T_map_place;
          ASSIGN_OR_RETURN(const Answer answer, localizer->Localize(QueryOf(descriptor)));
          if (answer.outcome != Outcome::kLocalized) return absl::OkStatus();
          const Pose& told = answer.candidates.front().T_map_query;
          (MissOf(DifferenceOf(told, truth)).any() ? num_false : num_right) += 1;
          return absl::OkStatus();
        });
    if (!visited.ok()) return visited;
    return absl::StrFormat(
        "  recall      %d of %d places that thinning left out are found from those that stay "
        "(%.1f %%), %d elsewhere\n",
        num_right, asked_.size(),
        100.0 * static_cast<double>(num_right) /
            static_cast<double>(std::max<std::size_t>(asked_.size(), 1)),
        num_false);
  }

 private:
  std::vector<mapdb::EditedPlace> asked_;  // ascending
};

class EditCommand : public Command {
 public:
  EditCommand()
      : Command("edit", "Make a new map of a map: without a session, cut, thinned, moved") {}
  void Declare(CLI::App& app) override {
    app.add_option("IN", in_, "Map file; it stays as it is")->required();
    app.add_option("OUT", out_, "Map file to make; must not exist")->required();
    edits_.Declare(app);
    geo_.Declare(app);
    AddThreadsOption(app, &num_threads_, "calibrate");
    AddQuietOption(app, &quiet_);
    app.footer(
        "OUT appears whole and on disk, or not at all; scanloc info tells what it was made of.\n"
        "Examples:\n"
        "  scanloc edit town.scanloc new.scanloc --drop-session 2024-03-night\n"
        "  scanloc edit town.scanloc new.scanloc --cut 120,-40,180,20 --thin 2\n"
        "  scanloc edit house.scanloc ground.scanloc --crop-floor 0,3 --rename-session a=b\n"
        "  scanloc edit town.scanloc utm.scanloc --transform 456000,5428000,110,0,0,31.5\n"
        "  scanloc edit town.scanloc new.scanloc --geo-fixes drive1.mcap");
  }
  [[nodiscard]] absl::Status CheckUsage() const override {
    RETURN_IF_ERROR(geo_.CheckUsage());
    return geo_.given() ? absl::OkStatus() : edits_.CheckUsage();
  }
  [[nodiscard]] absl::Status Run() override;

 private:
  /// What thinning costs; nothing without thinning, or without a method that tells poses.
  [[nodiscard]] absl::StatusOr<std::string> CostOfThinning(const std::vector<mapdb::Edit>& edits,
                                                           const mapdb::EditSummary& summary) const;

  std::string in_;
  std::string out_;
  EditOptions edits_;
  GeoOptions geo_;
  int num_threads_ = 0;
  bool quiet_ = false;
};

absl::StatusOr<std::string> EditCommand::CostOfThinning(const std::vector<mapdb::Edit>& edits,
                                                        const mapdb::EditSummary& summary) const {
  std::vector<mapdb::Edit> without;
  for (const mapdb::Edit& edit : edits) {
    if (!std::holds_alternative<mapdb::Thin>(edit)) without.push_back(edit);
  }
  if (without.size() == edits.size()) return std::string();
  ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(in_));
  if (!info.params.structure.enabled) return std::string();
  ASSIGN_OR_RETURN(const std::vector<mapdb::PlaceRecord> records, mapdb::ReadPlaces(in_));
  std::vector<mapdb::EditedPlace> places;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Place& place = records[i].place;
    places.push_back({i, info.sessions[static_cast<std::size_t>(place.session)].name,
                      place.stamp_ns, place.T_map_place});
  }
  ASSIGN_OR_RETURN(const mapdb::EditPlan all, mapdb::PlanEdits(std::move(places), without));
  return ThinningCost(all, summary.plan).Measure(in_, out_);
}

absl::Status EditCommand::Run() {
  CatchInterrupts();
  RETURN_IF_ERROR(geo_.Read());
  std::vector<mapdb::Edit> edits;
  std::string command = "edit";
  const std::vector<EditOptions::Given> given = edits_.Take();
  for (const EditOptions::Given& one : given) {
    edits.push_back(one.edit);
    absl::StrAppend(&command, " ", one.text);
  }
  std::string on_earth;
  std::string calibration;
  const auto finish = [&](const std::string& path) -> absl::Status {
    ASSIGN_OR_RETURN(on_earth, geo_.Apply(path));
    return Calibrating(num_threads_, quiet_, &calibration)(path);
  };
  ASSIGN_OR_RETURN(const mapdb::EditSummary summary,
                   mapdb::EditMap(in_, out_, edits, MadeNow(command), finish));
  std::string text = absl::StrFormat("edited %s into %s\n", Printable(in_), Printable(out_));
  std::size_t num_before = summary.num_places_before;
  for (std::size_t i = 0; i < given.size(); ++i) {
    const std::size_t num_left = summary.plan.num_left[i];
    absl::StrAppendFormat(&text, "  %s: %d places left out, %d left\n", Printable(given[i].text),
                          num_before - num_left, num_left);
    num_before = num_left;
  }
  absl::StrAppend(&text, "  content id  ", summary.content_id, "\n");
  ASSIGN_OR_RETURN(const std::string cost, CostOfThinning(edits, summary));
  return WriteText("-", text + on_earth + calibration + cost);
}

}  // namespace

std::unique_ptr<Command> MakeEditCommand() { return std::make_unique<EditCommand>(); }

}  // namespace scanloc::cli
