#include "scanloc/dataset/pose_reader.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <new>
#include <optional>
#include <span>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "dataset_frames.hpp"
#include "decimal_time.hpp"
#include "file_bytes.hpp"
#include "scanloc/core/limits.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

using Tokens = std::vector<std::string_view>;

constexpr std::int64_t kMaxTextFileBytes = 512LL << 20;

struct FormatInfo {
  PoseFormat format;
  std::string_view name;
  std::size_t num_values;  ///< in a row
};
constexpr std::array<FormatInfo, 6> kFormats = {{{PoseFormat::kAuto, "auto", 0},
                                                 {PoseFormat::kKitti, "kitti", 12},
                                                 {PoseFormat::kTum, "tum", 8},
                                                 {PoseFormat::kMulran, "mulran", 13},
                                                 {PoseFormat::kNclt, "nclt", 7},
                                                 {PoseFormat::kOxford, "oxford", 15}}};

const FormatInfo& Info(PoseFormat format) { return kFormats[static_cast<std::size_t>(format)]; }

absl::Status Bad(std::string_view reason) { return absl::InvalidArgumentError(ToAbsl(reason)); }

// The values of a row: between commas if it has any, else between blanks.
void SplitRow(std::string_view row, Tokens& tokens) {
  if (row.find(',') == std::string_view::npos) return SplitAtBlanks(row, tokens);
  tokens.clear();
  Tokens words;
  for (bool more = true; more;) {
    const std::size_t comma = row.find(',');
    SplitAtBlanks(row.substr(0, comma), words);
    // Two words between commas are one bad value, and none is one too: both fail to parse.
    tokens.push_back(words.size() == 1 ? words[0] : row.substr(0, comma));
    more = comma != std::string_view::npos && tokens.size() < kMaxTokens;
    if (more) row.remove_prefix(comma + 1);
  }
}

using RowHandler = std::function<absl::Status(const Tokens& row)>;

enum class BlankLines { kSkip, kOnlyAtEnd };

// Calls `handle` for each row that is no comment; a status it returns gets file and line.
absl::Status ForEachRow(const std::string& file, BlankLines blank_lines, const RowHandler& handle) {
  const absl::StatusOr<FileBytes> bytes = ReadFileBytes(file, kMaxTextFileBytes);
  if (!bytes.ok()) return bytes.status();
  LineReader lines(bytes->view());
  Tokens tokens;
  std::size_t first_blank_line = 0;
  std::size_t num_rows = 0;
  while (const std::optional<std::string_view> line = lines.Next()) {
    SplitRow(*line, tokens);
    if (!tokens.empty() && !tokens[0].empty() && tokens[0][0] == '#') continue;
    if (tokens.empty()) {
      if (first_blank_line == 0 && blank_lines == BlankLines::kOnlyAtEnd) {
        first_blank_line = lines.line_number();
      }
      continue;
    }
    if (first_blank_line != 0) {
      // Rows are paired by their number: a row that went missing must not shift the others.
      return Bad(absl::StrCat(file, ":", first_blank_line, ": blank line between rows"));
    }
    if (static_cast<std::int64_t>(++num_rows) > limits::kMaxPlaces) {
      return Bad(absl::StrCat(file, ": more than ", limits::kMaxPlaces, " rows"));
    }
    if (absl::Status status = handle(tokens); !status.ok()) {
      return Annotate(status, absl::StrCat(file, ":", lines.line_number()));
    }
  }
  if (num_rows == 0) return Bad(absl::StrCat(file, ": holds no row"));
  return absl::OkStatus();
}

absl::Status CheckNumValues(const Tokens& row, std::size_t expected) {
  if (row.size() == expected) return absl::OkStatus();
  return Bad(absl::StrCat("has ", row.size(), " values; ", expected, " are needed"));
}

template <std::size_t kNum>
absl::StatusOr<std::array<double, kNum>> ParseValues(std::span<const std::string_view> tokens) {
  std::array<double, kNum> values{};
  for (std::size_t i = 0; i < kNum; ++i) {
    if (!absl::SimpleAtod(ToAbsl(tokens[i]), &values[i])) {
      return Bad(absl::StrCat(Quote(tokens[i]), " is not a number"));
    }
  }
  return values;
}

absl::StatusOr<Pose> ParseMatrix(std::span<const std::string_view> tokens) {
  const absl::StatusOr<std::array<double, 12>> values = ParseValues<12>(tokens);
  if (!values.ok()) return values.status();
  using RowMajor = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  return PoseFromMatrix(Eigen::Map<const RowMajor>(values->data()));
}

absl::StatusOr<Pose> ParseQuaternion(std::span<const std::string_view> tokens) {
  const absl::StatusOr<std::array<double, 7>> values = ParseValues<7>(tokens);
  if (!values.ok()) return values.status();
  const auto& [tx, ty, tz, qx, qy, qz, qw] = *values;
  return PoseFromQuaternion({tx, ty, tz}, Eigen::Quaterniond(qw, qx, qy, qz));
}

absl::StatusOr<std::int64_t> ParseSeconds(std::string_view token) {
  const std::optional<std::int64_t> ns = ParseSecondsAsNs(token);
  if (!ns) return Bad(absl::StrCat(Quote(token), " is not a time in seconds"));
  return *ns;
}

absl::StatusOr<std::int64_t> ParseNanoseconds(std::string_view token) {
  std::int64_t ns = 0;
  if (!absl::SimpleAtoi(ToAbsl(token), &ns)) {
    return Bad(absl::StrCat(Quote(token), " is not a stamp in whole nanoseconds"));
  }
  return ns;
}

absl::StatusOr<std::int64_t> ParseMicroseconds(std::string_view token) {
  constexpr std::int64_t kMax_us = std::numeric_limits<std::int64_t>::max() / 1000;
  std::int64_t us = 0;
  if (!absl::SimpleAtoi(ToAbsl(token), &us) || us < 0 || us > kMax_us) {
    return Bad(absl::StrCat(Quote(token), " is not a stamp in whole microseconds"));
  }
  return us * 1000;
}

// A body in a world of x north, y east, z down, as the sensor at this place of the body in a world
// of z up.
absl::StatusOr<Pose> PoseFromDownward(const Eigen::Vector3d& position_m,
                                      const Eigen::Vector3d& roll_pitch_yaw_rad,
                                      const Eigen::Vector3d& sensor_m) {
  Eigen::Matrix<double, 3, 4> matrix;
  matrix << RotationOf(roll_pitch_yaw_rad), position_m;
  const absl::StatusOr<Pose> T_world_body = PoseFromMatrix(matrix);
  if (!T_world_body.ok()) return T_world_body.status();
  return Pose(Upward() * *T_world_body * Eigen::Translation3d(sensor_m) * Upward());
}

absl::StatusOr<Pose> ParseNclt(std::span<const std::string_view> tokens) {
  const auto values = ParseValues<6>(tokens);
  if (!values.ok()) return values.status();
  const auto& [x, y, z, roll, pitch, yaw] = *values;
  return PoseFromDownward({x, y, z}, {roll, pitch, yaw}, kNcltSensor_m);
}

// northing, easting and down are columns 5 to 7, roll, pitch and yaw 12 to 14.
absl::StatusOr<Pose> ParseOxford(std::span<const std::string_view> tokens) {
  const auto position = ParseValues<3>(tokens.subspan(5, 3));
  if (!position.ok()) return position.status();
  const auto turn = ParseValues<3>(tokens.subspan(12, 3));
  if (!turn.ok()) return turn.status();
  return PoseFromDownward(Eigen::Vector3d(position->data()), Eigen::Vector3d(turn->data()),
                          OxfordSensor_m());
}

absl::Status CheckOxfordHeader(const Tokens& row) {
  static constexpr std::array<std::pair<std::size_t, std::string_view>, 7> kColumns = {
      {{0, "timestamp"},
       {5, "northing"},
       {6, "easting"},
       {7, "down"},
       {12, "roll"},
       {13, "pitch"},
       {14, "yaw"}}};
  for (const auto& [column, name] : kColumns) {
    if (column >= row.size() || row[column] != name) {
      return Bad(absl::StrCat("column ", column + 1, " of the header is not ", ToAbsl(name),
                              ", as that of ins.csv is"));
    }
  }
  return absl::OkStatus();
}

bool HoldsNan(const Tokens& row) {
  return std::any_of(row.begin(), row.end(), [](std::string_view token) {
    return absl::EqualsIgnoreCase(ToAbsl(token), "nan");
  });
}

// A row without its stamp, and the stamp if the format has one.
struct Row {
  absl::StatusOr<Pose> pose;
  std::optional<absl::StatusOr<std::int64_t>> stamp_ns;
};

Row ParseRow(PoseFormat format, std::span<const std::string_view> tokens) {
  switch (format) {
    case PoseFormat::kTum:
      return {ParseQuaternion(tokens.subspan(1)), ParseSeconds(tokens[0])};
    case PoseFormat::kMulran:
      return {ParseMatrix(tokens.subspan(1)), ParseNanoseconds(tokens[0])};
    case PoseFormat::kNclt:
      return {ParseNclt(tokens.subspan(1)), ParseMicroseconds(tokens[0])};
    case PoseFormat::kOxford:
      return {ParseOxford(tokens), ParseMicroseconds(tokens[0])};
    default:
      return {ParseMatrix(tokens), std::nullopt};
  }
}

absl::Status AppendRow(const Tokens& tokens, Trajectory& trajectory) {
  absl::Status status = CheckNumValues(tokens, Info(trajectory.format).num_values);
  if (!status.ok()) return status;
  if (trajectory.format == PoseFormat::kNclt && HoldsNan(tokens)) return absl::OkStatus();
  const Row row = ParseRow(trajectory.format, tokens);
  if (row.stamp_ns.has_value()) {
    if (!row.stamp_ns->ok()) return row.stamp_ns->status();
    trajectory.stamps_ns.push_back(**row.stamp_ns);
  }
  if (!row.pose.ok()) return row.pose.status();
  trajectory.T_map_sensor.push_back(*row.pose);
  return absl::OkStatus();
}

absl::StatusOr<PoseFormat> DetectFormat(std::size_t num_values) {
  for (const FormatInfo& info : kFormats) {
    if (info.num_values == num_values && info.format != PoseFormat::kAuto) return info.format;
  }
  return Bad(absl::StrCat("cannot tell the format of the poses: the first row has ", num_values,
                          " values; KITTI rows have 12, TUM rows 8, MulRan rows 13, NCLT "
                          "rows 7, Oxford's 15"));
}

absl::Status ApplyCalib(const std::string& calib_file, Trajectory& trajectory) {
  const absl::StatusOr<Pose> T_body_sensor = ReadCalib(calib_file);
  if (!T_body_sensor.ok()) return T_body_sensor.status();
  const Pose T_map_world =
      trajectory.format == PoseFormat::kKitti ? T_body_sensor->inverse() : Pose::Identity();
  for (Pose& pose : trajectory.T_map_sensor) pose = T_map_world * pose * *T_body_sensor;
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PoseFormat> ParsePoseFormat(std::string_view name) {
  for (const FormatInfo& info : kFormats) {
    if (info.name == name) return info.format;
  }
  return Bad(absl::StrCat("pose format ", Quote(name),
                          " is not auto, kitti, tum, mulran, nclt or oxford"));
}

std::string_view PoseFormatName(PoseFormat format) { return Info(format).name; }

absl::StatusOr<Trajectory> ReadTrajectory(const std::string& poses_file, PoseFormat format,
                                          const std::string& calib_file) try {
  Trajectory trajectory;
  trajectory.format = format;
  bool has_header = false;
  absl::Status status =
      ForEachRow(poses_file, BlankLines::kOnlyAtEnd, [&](const Tokens& row) -> absl::Status {
        if (row[0] == "timestamp" && !has_header &&
            (trajectory.format == PoseFormat::kAuto || trajectory.format == PoseFormat::kOxford)) {
          has_header = true;
          trajectory.format = PoseFormat::kOxford;
          return CheckOxfordHeader(row);
        }
        if (trajectory.format == PoseFormat::kAuto) {
          const absl::StatusOr<PoseFormat> detected = DetectFormat(row.size());
          if (!detected.ok()) return detected.status();
          trajectory.format = *detected;
        }
        if (trajectory.format == PoseFormat::kOxford && !has_header) {
          return Bad("ins.csv begins with a header; this is none");
        }
        return AppendRow(row, trajectory);
      });
  if (status.ok() && !calib_file.empty()) status = ApplyCalib(calib_file, trajectory);
  if (!status.ok()) return status;
  if (trajectory.T_map_sensor.empty()) return Bad(absl::StrCat(poses_file, ": holds no pose"));
  return trajectory;
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError(absl::StrCat(poses_file, ": out of memory"));
}

absl::StatusOr<Pose> ReadCalib(const std::string& calib_file) try {
  std::optional<Pose> T_camera_sensor;
  absl::Status status =
      ForEachRow(calib_file, BlankLines::kSkip, [&](const Tokens& row) -> absl::Status {
        if (row[0] != "Tr:") return absl::OkStatus();
        if (absl::Status num = CheckNumValues(row, 13); !num.ok()) return num;
        if (T_camera_sensor.has_value()) return Bad("a second Tr: row");
        const absl::StatusOr<Pose> pose = ParseMatrix(std::span(row).subspan(1));
        if (!pose.ok()) return pose.status();
        T_camera_sensor = *pose;
        return absl::OkStatus();
      });
  if (!status.ok()) return status;
  if (!T_camera_sensor.has_value()) {
    return Bad(absl::StrCat(calib_file,
                            ": has no row \"Tr: \" with 12 values; the calib.txt of the KITTI "
                            "odometry benchmark has one"));
  }
  return *T_camera_sensor;
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError(absl::StrCat(calib_file, ": out of memory"));
}

absl::StatusOr<std::vector<std::int64_t>> ReadTimes(const std::string& times_file) try {
  std::vector<std::int64_t> stamps_ns;
  absl::Status status =
      ForEachRow(times_file, BlankLines::kOnlyAtEnd, [&](const Tokens& row) -> absl::Status {
        if (absl::Status num = CheckNumValues(row, 1); !num.ok()) return num;
        const absl::StatusOr<std::int64_t> ns = ParseSeconds(row[0]);
        if (!ns.ok()) return ns.status();
        stamps_ns.push_back(*ns);
        return absl::OkStatus();
      });
  if (!status.ok()) return status;
  return stamps_ns;
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError(absl::StrCat(times_file, ": out of memory"));
}

}  // namespace scanloc::dataset
