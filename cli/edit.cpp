#include <CLI/App.hpp>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cli/calibrate.hpp"
#include "cli/command.hpp"
#include "cli/geo_options.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "cli/provenance.hpp"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/edit_map.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {
namespace {

using mapdb::Edit;
using mapdb::Region;
using StatusOrEdit = absl::StatusOr<Edit>;

constexpr double kNsPerS = 1e9;
/// Seconds that fit whole nanoseconds.
constexpr double kMaxStamp_s = 9e9;

absl::StatusOr<Region> BoxRegion(const std::string& text) {
  ASSIGN_OR_RETURN(const auto n, ParseNumbers(text, 4, "X0,Y0,X1,Y1"));
  const double x0 = std::min(n[0], n[2]);
  const double x1 = std::max(n[0], n[2]);
  const double y0 = std::min(n[1], n[3]);
  const double y1 = std::max(n[1], n[3]);
  return Region{.polygon = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}};
}

absl::StatusOr<Region> PolygonRegion(const std::string& text) {
  const auto num_commas = static_cast<std::size_t>(std::ranges::count(text, ','));
  if (num_commas < 5 || num_commas % 2 == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", text, "\" is not X,Y,X,Y,X,Y,...: at least 3 corners"));
  }
  ASSIGN_OR_RETURN(const auto n, ParseNumbers(text, num_commas + 1, "X,Y,X,Y,..."));
  Region region;
  for (std::size_t i = 0; i < n.size(); i += 2) region.polygon.emplace_back(n[i], n[i + 1]);
  return region;
}

absl::StatusOr<Region> TimeRegion(const std::string& text) {
  ASSIGN_OR_RETURN(const auto n, ParseNumbers(text, 2, "FROM,TO"));
  for (const double seconds : n) {
    if (!(std::abs(seconds) <= kMaxStamp_s)) {
      return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is out of range [s]"));
    }
  }
  return Region{.stamps_ns = std::pair{std::llround(n[0] * kNsPerS), std::llround(n[1] * kNsPerS)}};
}

absl::StatusOr<Region> FloorRegion(const std::string& text) {
  ASSIGN_OR_RETURN(const auto n, ParseNumbers(text, 2, "Z0,Z1"));
  return Region{.heights_m = std::pair{n[0], n[1]}};
}

template <typename Kind, absl::StatusOr<Region> (*kParse)(const std::string&)>
StatusOrEdit InRegion(const std::string& text) {
  ASSIGN_OR_RETURN(Region region, kParse(text));
  return Kind{std::move(region)};
}

template <typename Kind>
StatusOrEdit Named(const std::string& text) {
  return Kind{text};
}

StatusOrEdit Renamed(const std::string& text) {
  const std::size_t at = text.find('=');
  if (at == std::string::npos) {
    return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is not OLD=NEW"));
  }
  return mapdb::RenameSession{text.substr(0, at), text.substr(at + 1)};
}

StatusOrEdit ParseThinned(const std::string& text) {
  double spacing_m = 0.0;
  if (!absl::SimpleAtod(text, &spacing_m) || !(spacing_m > 0.0)) {
    return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is no distance above 0 [m]"));
  }
  return mapdb::Thin{spacing_m};
}

StatusOrEdit Moved(const std::string& text) {
  ASSIGN_OR_RETURN(const auto n, ParseNumbers(text, 6, "X,Y,Z,ROLL,PITCH,YAW"));
  // Angles as of a mount; the offset may be as far as a map frame.
  ASSIGN_OR_RETURN(Pose pose, MountPose(Eigen::Vector3d::Zero(), {n[3], n[4], n[5]}));
  pose.translation() << n[0], n[1], n[2];
  return mapdb::Transform{pose};
}

/// Edits of a map as options of the command line, in the order given.
class EditOptions {
 public:
  /// Those that need no more than the map.
  void Declare(CLI::App& app) {
    app_ = &app;
    const OptionGroup group(app, "Edits, each as often as need be, done in the order given");
    Add(app, "--drop-session", &Named<mapdb::DropSession>, "NAME", "Leave a session out");
    Add(app, "--keep-session", &Named<mapdb::KeepSession>, "NAME",
        "Leave all others out; several in a row keep each");
    Add(app, "--rename-session", &Renamed, "OLD=NEW", "Name a session anew");
    Add(app, "--merge-sessions", &Named<mapdb::MergeSessions>, "NAME",
        "Make one session of all, of this name");
    Add(app, "--crop", &InRegion<mapdb::Crop, &BoxRegion>, "X0,Y0,X1,Y1",
        "Keep the places inside, map frame [m]");
    Add(app, "--cut", &InRegion<mapdb::Cut, &BoxRegion>, "X0,Y0,X1,Y1", "Leave those out");
    Add(app, "--crop-polygon", &InRegion<mapdb::Crop, &PolygonRegion>, "X,Y,X,Y,...",
        "Keep the places inside a polygon");
    Add(app, "--cut-polygon", &InRegion<mapdb::Cut, &PolygonRegion>, "X,Y,X,Y,...",
        "Leave those out");
    Add(app, "--crop-time", &InRegion<mapdb::Crop, &TimeRegion>, "FROM,TO",
        "Keep the places of a time, both ends included, as stamps are [s]");
    Add(app, "--cut-time", &InRegion<mapdb::Cut, &TimeRegion>, "FROM,TO", "Leave those out");
    Add(app, "--crop-floor", &InRegion<mapdb::Crop, &FloorRegion>, "Z0,Z1",
        "Keep the places whose sensor stood so high, map frame [m]");
    Add(app, "--cut-floor", &InRegion<mapdb::Cut, &FloorRegion>, "Z0,Z1", "Leave those out");
    Add(app, "--thin", &ParseThinned, "METRES",
        "Leave places out that have one built later within so much");
    Add(app, "--transform", &Moved, "X,Y,Z,ROLL,PITCH,YAW",
        "Move the map into another frame: T_new_old [m, deg]");
  }

  /// OK, or InvalidArgument: there is no edit.
  [[nodiscard]] absl::Status CheckUsage() const {
    const bool has_edit =
        std::ranges::any_of(kinds_, [](const Kind& kind) { return kind.option->count() > 0; });
    if (has_edit) return absl::OkStatus();
    return absl::InvalidArgumentError("say what to edit, for example --drop-session NAME");
  }

  /// In the order of the command line.
  struct Given {
    std::string text;  ///< as it was given
    mapdb::Edit edit;
  };
  [[nodiscard]] std::vector<Given> Take() const {
    std::vector<Given> given;
    std::map<const CLI::Option*, std::size_t> num_taken;
    for (const CLI::Option* option : app_->parse_order()) {
      const auto kind = std::ranges::find(kinds_, option, &Kind::option);
      if (kind == kinds_.end()) continue;
      const std::string& text = option->results()[num_taken[option]++];
      given.push_back({absl::StrCat(option->get_name(), " ", text), *kind->parse(text)});
    }
    return given;
  }

 private:
  struct Kind {
    CLI::Option* option = nullptr;
    /// InvalidArgument: the text is none of this kind.
    absl::StatusOr<mapdb::Edit> (*parse)(const std::string& text) = nullptr;
  };
  void Add(CLI::App& app, const char* flag,
           absl::StatusOr<mapdb::Edit> (*parse)(const std::string&), const char* type,
           const char* what) {
    CLI::Option* option = app.add_option(flag)
                              ->description(what)
                              ->type_name(type)
                              ->expected(1)
                              ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
                              ->check(ParsedBy(parse));
    kinds_.push_back({option, parse});
  }

  const CLI::App* app_ = nullptr;
  std::vector<Kind> kinds_;
};

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
  [[nodiscard]] absl::Status Run() override {
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

 private:
  /// What thinning costs; nothing without thinning, or without a method that tells poses.
  [[nodiscard]] absl::StatusOr<std::string> CostOfThinning(
      const std::vector<mapdb::Edit>& edits, const mapdb::EditSummary& summary) const {
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

  std::string in_;
  std::string out_;
  EditOptions edits_;
  GeoOptions geo_;
  int num_threads_ = 0;
  bool quiet_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeEditCommand() { return std::make_unique<EditCommand>(); }

}  // namespace scanloc::cli
