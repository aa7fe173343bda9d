#pragma once

#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/eval/judging.hpp"
#include "scanloc/report/answer_json.hpp"
#include "scanloc/report/json.hpp"

/// What the documents of locate and eval both hold.
namespace scanloc::report {

inline Json MountToJson(const SensorMount& mount) {
  Json json{{"T_base_sensor", PoseToJson(mount.T_base_sensor)},
            {"min_range_m", mount.min_range_m},
            {"self_box", nullptr}};
  if (mount.self_box) {
    const Box& box = *mount.self_box;
    json["self_box"] = {box.min_m.x(), box.min_m.y(), box.min_m.z(),
                        box.max_m.x(), box.max_m.y(), box.max_m.z()};
  }
  return json;
}

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
