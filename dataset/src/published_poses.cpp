#include "published_poses.hpp"

#include <array>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dataset_frames.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

// A body in a world of x north, y east, z down, as the sensor at this place of the body in a world
// of z up.
absl::StatusOr<Pose> PoseFromDownward(const Eigen::Vector3d& position_m,
                                      const Eigen::Vector3d& roll_pitch_yaw_rad,
                                      const Eigen::Vector3d& sensor_m) {
  Eigen::Matrix<double, 3, 4> matrix;
  matrix << RotationOf(roll_pitch_yaw_rad), position_m;
  ASSIGN_OR_RETURN(const Pose T_world_body, PoseFromMatrix(matrix));
  return Pose(Upward() * T_world_body * Eigen::Translation3d(sensor_m) * Upward());
}

}  // namespace

absl::StatusOr<Pose> ParseNclt(std::span<const std::string_view> tokens) {
  ASSIGN_OR_RETURN(const auto values, ParseValues<6>(tokens));
  const auto& [x, y, z, roll, pitch, yaw] = values;
  return PoseFromDownward({x, y, z}, {roll, pitch, yaw}, kNcltSensor_m);
}

// northing, easting and down are columns 5 to 7, roll, pitch and yaw 12 to 14.
absl::StatusOr<Pose> ParseOxford(std::span<const std::string_view> tokens) {
  ASSIGN_OR_RETURN(const auto position, ParseValues<3>(tokens.subspan(5, 3)));
  ASSIGN_OR_RETURN(const auto turn, ParseValues<3>(tokens.subspan(12, 3)));
  static const Eigen::Vector3d kSensor_m = OxfordSensor_m();
  return PoseFromDownward(Eigen::Vector3d(position.data()), Eigen::Vector3d(turn.data()),
                          kSensor_m);
}

absl::Status CheckOxfordHeader(const Tokens& row) {
  static constexpr std::array<std::pair<std::size_t, std::string_view>, 8> kColumns = {
      {{0, "timestamp"},
       {1, "ins_status"},
       {5, "northing"},
       {6, "easting"},
       {7, "down"},
       {12, "roll"},
       {13, "pitch"},
       {14, "yaw"}}};
  for (const auto& [column, name] : kColumns) {
    if (column >= row.size() || row[column] != name) {
      return Invalid(absl::StrCat("column ", column + 1, " of the header is not ", ToAbsl(name),
                                  ", as that of ins.csv is"));
    }
  }
  return absl::OkStatus();
}

bool IsGoodOxfordSolution(std::span<const std::string_view> tokens) {
  return tokens[1] == "INS_SOLUTION_GOOD";
}

}  // namespace scanloc::dataset
