#include "cli/edit_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <map>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/core/status_macros.hpp"

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

}  // namespace

void EditOptions::Add(CLI::App& app, const char* flag, StatusOrEdit (*parse)(const std::string&),
                      const char* type, const char* what) {
  CLI::Option* option = app.add_option(flag)
                            ->description(what)
                            ->type_name(type)
                            ->expected(1)
                            ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
                            ->check(ParsedBy(parse));
  kinds_.push_back({option, parse});
}

void EditOptions::Declare(CLI::App& app) {
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

absl::Status EditOptions::CheckUsage() const {
  const bool has_edit =
      std::ranges::any_of(kinds_, [](const Kind& kind) { return kind.option->count() > 0; });
  if (has_edit) return absl::OkStatus();
  return absl::InvalidArgumentError("say what to edit, for example --drop-session NAME");
}

std::vector<EditOptions::Given> EditOptions::Take() const {
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

}  // namespace scanloc::cli
