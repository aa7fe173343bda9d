#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/mapdb/history.hpp"
#include "scanloc/mapdb/merge_maps.hpp"

namespace scanloc::mapdb {

/// A part of a map; what is left open restricts nothing.
struct Region {
  std::vector<Eigen::Vector2d>
      polygon;  ///< corners in the plane of the map [m]; at least 3, or none
  std::optional<std::pair<std::int64_t, std::int64_t>> stamps_ns;  ///< both included
  std::optional<std::pair<double, double>> heights_m;  ///< of the sensor, along z; both included
};

struct DropSession {
  std::string name;
};
/// Several that follow each other keep the sessions of all.
struct KeepSession {
  std::string name;
};
struct RenameSession {
  std::string from;
  std::string to;
};
/// Makes one session of all, in their order.
struct MergeSessions {
  std::string name;
};
/// Keeps what lies inside ...
struct Crop {
  Region region;
};
/// ... or outside.
struct Cut {
  Region region;
};
/// Leaves out places that have a newer one within so much: what was built last stays.
struct Thin {
  double spacing_m = 0.0;  ///< above 0
};
/// Moves the whole map into another frame.
struct Transform {
  Pose T_new_old = Pose::Identity();
};
using Edit = std::variant<DropSession, KeepSession, RenameSession, MergeSessions, Crop, Cut, Thin,
                          Transform>;

/// A place as the edits leave it.
struct EditedPlace {
  std::size_t place = 0;  ///< in the map that is edited
  std::string session;
  std::int64_t stamp_ns = 0;
  Pose T_map_place = Pose::Identity();
};

struct EditPlan {
  std::vector<EditedPlace> places;    ///< those that stay, in their order
  std::vector<std::size_t> num_left;  ///< places after each edit
};

/// What the edits, in the order given, make of these places. A pure function.
///
/// InvalidArgument: a region, spacing or pose that is none, or no place would be left; NotFound:
/// no such session, naming those that there are; AlreadyExists: a session of that name. Each tells
/// which edit.
[[nodiscard]] absl::StatusOr<EditPlan> PlanEdits(std::vector<EditedPlace> places,
                                                 const std::vector<Edit>& edits);

struct EditSummary {
  std::string content_id;
  std::size_t num_places_before = 0;
  EditPlan plan;
};

/// Writes a new map that is `in` as edited; `in` is not changed. Calibrating it is for `finish`.
///
/// A map that is moved has no geo origin any more. As of MergeMaps: the file appears whole or not
/// at all, and has a history. AlreadyExists, FailedPrecondition (incomplete) and the errors of
/// map_file.hpp and PlanEdits.
[[nodiscard]] absl::StatusOr<EditSummary> EditMap(const std::string& in, const std::string& out,
                                                  const std::vector<Edit>& edits,
                                                  HistoryEntry made_by, const Finish& finish = {});

/// A new map of the places of `old_map` that are not in `replaced`, and behind them all of
/// `new_map`, whose sessions get names that are free. Errors as of EditMap.
[[nodiscard]] absl::StatusOr<std::string> ReplacePlaces(
    const std::string& old_map, const std::vector<bool>& replaced, const std::string& new_map,
    const std::string& out, HistoryEntry made_by, const Finish& finish = {});

}  // namespace scanloc::mapdb
