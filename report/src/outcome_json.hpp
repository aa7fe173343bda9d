#pragma once

#include "scanloc/eval/judging.hpp"
#include "scanloc/report/json.hpp"

/// What the documents of locate and eval both hold.
namespace scanloc::report {

inline void AddOutcomes(const eval::OutcomeCounts& counts, Json* json) {
  (*json)["num_queries"] = counts.num_queries;
  (*json)["num_localized"] = counts.num_localized;
  (*json)["num_ambiguous"] = counts.num_ambiguous;
  (*json)["num_not_recognized"] = counts.num_not_recognized;
  (*json)["num_insufficient"] = counts.num_insufficient;
}

inline void AddRightAndFalse(const eval::OutcomeCounts& counts, Json* json) {
  (*json)["num_pose_right"] = counts.num_pose_right;
  (*json)["num_localized_right"] = counts.num_localized_right;
  (*json)["num_false"] = counts.num_false;
  (*json)["num_false_plane"] = counts.num_false_plane;
  (*json)["num_false_height"] = counts.num_false_height;
  (*json)["num_false_heading"] = counts.num_false_heading;
}

}  // namespace scanloc::report
