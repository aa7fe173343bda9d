#include <cstdint>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "absl/strings/str_cat.h"
#include "file_bytes.hpp"
#include "pose_rows.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/dataset/pose_reader.hpp"

namespace scanloc::dataset {
namespace {

using Json = nlohmann::json;

constexpr std::int64_t kMaxCalibBytes = 1LL << 20;

absl::StatusOr<Pose> PoseFromJson(const Json& rows) {
  Eigen::Matrix4d matrix;
  if (!rows.is_array() || rows.size() != 4) return Invalid("is not an array of 4 rows");
  for (int row = 0; row < 4; ++row) {
    const Json& values = rows[static_cast<std::size_t>(row)];
    if (!values.is_array() || values.size() != 4) {
      return Invalid(absl::StrCat("row ", row, " is not an array of 4 numbers"));
    }
    for (int column = 0; column < 4; ++column) {
      const Json& value = values[static_cast<std::size_t>(column)];
      if (!value.is_number()) {
        return Invalid(absl::StrCat("row ", row, ", column ", column, " is not a number"));
      }
      matrix(row, column) = value.get<double>();
    }
  }
  return PoseFromHomogeneous(matrix);
}

// NAVER LABS: {"Extrinsic": {"Lidar": 4x4, ...}, ...}.
absl::StatusOr<Pose> ReadJsonCalib(const std::string& text) {
  const Json calib = Json::parse(text, nullptr, false);
  if (calib.is_discarded()) return Invalid("is not JSON");
  const auto extrinsic = calib.find("Extrinsic");
  if (extrinsic == calib.end() || !extrinsic->is_object() || !extrinsic->contains("Lidar")) {
    return Invalid("has no entry \"Lidar\" in \"Extrinsic\"");
  }
  const absl::StatusOr<Pose> pose = PoseFromJson((*extrinsic)["Lidar"]);
  return pose.ok() ? pose : Annotate(pose.status(), "\"Lidar\" in \"Extrinsic\"");
}

absl::StatusOr<Pose> ReadTrRow(const std::string& calib_file) {
  std::optional<Pose> T_camera_sensor;
  absl::Status status =
      ForEachRow(calib_file, BlankLines::kSkip, [&](const TextRow& text_row) -> absl::Status {
        const Tokens& row = text_row.values;
        if (row[0] != "Tr:") return absl::OkStatus();
        RETURN_IF_ERROR(CheckNumValues(row, 13));
        if (T_camera_sensor.has_value()) return Invalid("a second Tr: row");
        ASSIGN_OR_RETURN(T_camera_sensor, ParseMatrix(std::span(row).subspan(1)));
        return absl::OkStatus();
      });
  if (!status.ok()) return status;
  if (T_camera_sensor.has_value()) return *T_camera_sensor;
  return Invalid(absl::StrCat(calib_file,
                              ": has no row \"Tr: \" with 12 values; the calib.txt of the KITTI "
                              "odometry benchmark has one"));
}

}  // namespace

absl::StatusOr<Pose> ReadCalib(const std::string& calib_file) try {
  ASSIGN_OR_RETURN(const FileBytes bytes, ReadFileBytes(calib_file, kMaxCalibBytes));
  const std::size_t first = bytes.view().find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos || bytes.view()[first] != '{') return ReadTrRow(calib_file);
  const absl::StatusOr<Pose> pose = ReadJsonCalib(std::string(bytes.view()));
  return pose.ok() ? pose : Annotate(pose.status(), calib_file);
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError(absl::StrCat(calib_file, ": out of memory"));
}

}  // namespace scanloc::dataset
