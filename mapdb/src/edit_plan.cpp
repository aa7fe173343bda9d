#include <algorithm>
#include <array>
#include <set>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/edit_map.hpp"

namespace scanloc::mapdb {
namespace {

using Places = std::vector<EditedPlace>;

constexpr double kMaxSpacing_m = 1e6;

std::set<std::string> SessionsOf(const Places& places) {
  std::set<std::string> names;
  for (const EditedPlace& place : places) names.insert(place.session);
  return names;
}

absl::Status CheckHasSession(const Places& places, const std::string& name) {
  const std::set<std::string> names = SessionsOf(places);
  if (names.contains(name)) return absl::OkStatus();
  return absl::NotFoundError(absl::StrCat("there is no session '", Printable(name),
                                          "'; there are: ", Printable(absl::StrJoin(names, ", "))));
}

absl::Status CheckSessionName(const std::string& name) {
  if (!name.empty() && name.size() <= limits::kMaxNameBytes) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "a session's name has 1 to ", limits::kMaxNameBytes, " bytes, not ", name.size()));
}

absl::Status Check(const Region& region) {
  if (region.polygon.empty() && !region.stamps_ns && !region.heights_m) {
    return absl::InvalidArgumentError("the region is without bounds");
  }
  if (!region.polygon.empty() && region.polygon.size() < 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("a polygon has at least 3 corners, not ", region.polygon.size()));
  }
  for (const Eigen::Vector2d& corner : region.polygon) {
    if (!corner.allFinite()) return absl::InvalidArgumentError("a corner is not finite");
  }
  if (region.stamps_ns && region.stamps_ns->first > region.stamps_ns->second) {
    return absl::InvalidArgumentError("the time ends before it begins");
  }
  if (region.heights_m && !(region.heights_m->first <= region.heights_m->second)) {
    return absl::InvalidArgumentError("the heights end below where they begin");
  }
  return absl::OkStatus();
}

/// Even-odd rule; a point on an edge is inside one of the two sides of it.
bool IsInPolygon(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& at) {
  bool is_inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[j];
    if ((a.y() > at.y()) == (b.y() > at.y())) continue;
    const double x = a.x() + (at.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    if (at.x() < x) is_inside = !is_inside;
  }
  return is_inside;
}

bool IsIn(const Region& region, const EditedPlace& place) {
  const Eigen::Vector3d at = place.T_map_place.translation();
  const auto& stamps = region.stamps_ns;
  const auto& heights = region.heights_m;
  return (region.polygon.empty() || IsInPolygon(region.polygon, at.head<2>())) &&
         (!stamps || (place.stamp_ns >= stamps->first && place.stamp_ns <= stamps->second)) &&
         (!heights || (at.z() >= heights->first && at.z() <= heights->second));
}

/// Which places stay that have no newer one within the spacing.
std::vector<bool> Thinned(const Places& places, double spacing_m) {
  const Eigen::Vector3d origin = places.front().T_map_place.translation();
  absl::flat_hash_map<std::array<int, 3>, std::vector<Eigen::Vector3d>> kept_in;  // by cell
  std::vector<bool> stays(places.size(), false);
  for (std::size_t i = places.size(); i-- > 0;) {
    const Eigen::Vector3d at = places[i].T_map_place.translation() - origin;
    const Eigen::Vector3i cell = (at / spacing_m).array().floor().cast<int>();
    bool is_free = true;
    for (int n = 0; n < 27 && is_free; ++n) {
      const Eigen::Vector3i near = cell + Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      const auto found = kept_in.find({near.x(), near.y(), near.z()});
      if (found == kept_in.end()) continue;
      is_free = std::ranges::none_of(
          found->second, [&](const auto& other) { return (other - at).norm() < spacing_m; });
    }
    if (!is_free) continue;
    stays[i] = true;
    kept_in[{cell.x(), cell.y(), cell.z()}].push_back(at);
  }
  return stays;
}

template <typename Stays>
void KeepIf(Places& places, Stays&& stays) {
  Places kept;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (stays(i)) kept.push_back(std::move(places[i]));
  }
  places = std::move(kept);
}

/// Applies the edits to places, one after the other.
class Editor {
 public:
  Editor(Places places, const std::vector<Edit>& edits)
      : places_(std::move(places)), edits_(edits) {}

  absl::StatusOr<EditPlan> Run() {
    EditPlan plan;
    for (number_ = 0; number_ < edits_.size(); ++number_) {
      absl::Status status =
          std::visit([&](const auto& edit) { return Apply(edit); }, edits_[number_]);
      if (status.ok() && places_.empty()) {
        status = absl::InvalidArgumentError("it would leave no place");
      }
      if (!status.ok()) {
        return absl::Status(status.code(), absl::StrCat("edit ", number_ + 1, " of ", edits_.size(),
                                                        ": ", status.message()));
      }
      plan.num_left.push_back(places_.size());
    }
    plan.places = std::move(places_);
    return plan;
  }

 private:
  absl::Status Apply(const DropSession& edit) {
    RETURN_IF_ERROR(CheckHasSession(places_, edit.name));
    KeepIf(places_, [&](std::size_t i) { return places_[i].session != edit.name; });
    return absl::OkStatus();
  }

  absl::Status Apply(const KeepSession& edit) {
    // The first of several looks ahead; the others find their sessions there.
    RETURN_IF_ERROR(CheckHasSession(places_, edit.name));
    std::set<std::string> names;
    for (std::size_t i = number_; i < edits_.size(); ++i) {
      const auto* keep = std::get_if<KeepSession>(&edits_[i]);
      if (keep == nullptr) break;
      names.insert(keep->name);
    }
    const bool is_first = number_ == 0 || !std::holds_alternative<KeepSession>(edits_[number_ - 1]);
    if (is_first)
      KeepIf(places_, [&](std::size_t i) { return names.contains(places_[i].session); });
    return absl::OkStatus();
  }

  absl::Status Apply(const RenameSession& edit) {
    RETURN_IF_ERROR(CheckHasSession(places_, edit.from));
    RETURN_IF_ERROR(CheckSessionName(edit.to));
    if (edit.to != edit.from && CheckHasSession(places_, edit.to).ok()) {
      return absl::AlreadyExistsError(absl::StrCat("there is a session '", Printable(edit.to),
                                                   "' already; choose another name"));
    }
    for (EditedPlace& place : places_) {
      if (place.session == edit.from) place.session = edit.to;
    }
    return absl::OkStatus();
  }

  absl::Status Apply(const MergeSessions& edit) {
    RETURN_IF_ERROR(CheckSessionName(edit.name));
    for (EditedPlace& place : places_) place.session = edit.name;
    return absl::OkStatus();
  }

  absl::Status Apply(const Crop& edit) {
    RETURN_IF_ERROR(Check(edit.region));
    KeepIf(places_, [&](std::size_t i) { return IsIn(edit.region, places_[i]); });
    return absl::OkStatus();
  }

  absl::Status Apply(const Cut& edit) {
    RETURN_IF_ERROR(Check(edit.region));
    KeepIf(places_, [&](std::size_t i) { return !IsIn(edit.region, places_[i]); });
    return absl::OkStatus();
  }

  absl::Status Apply(const Thin& edit) {
    if (!(edit.spacing_m > 0.0 && edit.spacing_m <= kMaxSpacing_m)) {
      return absl::InvalidArgumentError(absl::StrCat("the spacing is ", edit.spacing_m,
                                                     " m; it must be in (0, ", kMaxSpacing_m, "]"));
    }
    const std::vector<bool> stays = Thinned(places_, edit.spacing_m);
    KeepIf(places_, [&](std::size_t i) { return stays[i]; });
    return absl::OkStatus();
  }

  absl::Status Apply(const Transform& edit) {
    for (EditedPlace& place : places_) {
      const Pose moved = edit.T_new_old * place.T_map_place;
      ASSIGN_OR_RETURN(place.T_map_place, PoseFromMatrix(moved.matrix().topRows<3>()));
    }
    return absl::OkStatus();
  }

  Places places_;
  const std::vector<Edit>& edits_;
  std::size_t number_ = 0;
};

}  // namespace

absl::StatusOr<EditPlan> PlanEdits(std::vector<EditedPlace> places,
                                   const std::vector<Edit>& edits) {
  return Editor(std::move(places), edits).Run();
}

}  // namespace scanloc::mapdb
