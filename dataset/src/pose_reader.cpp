#include "scanloc/dataset/pose_reader.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <new>
#include <optional>
#include <span>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "dataset_frames.hpp"
#include "decimal_time.hpp"
#include "file_bytes.hpp"
#include "pose_rows.hpp"
#include "published_poses.hpp"

namespace scanloc::dataset {
namespace {

struct FormatInfo {
  PoseFormat format;
  std::string_view name;
  std::size_t num_values;  ///< in a row
};
// Of NAVER LABS's poses where numpy wrote each row of the matrix into a line of its own.
constexpr std::size_t kRowOfMatrix = 4;

constexpr std::array<FormatInfo, 7> kFormats = {{{PoseFormat::kAuto, "auto", 0},
                                                 {PoseFormat::kKitti, "kitti", 12},
                                                 {PoseFormat::kTum, "tum", 8},
                                                 {PoseFormat::kMulran, "mulran", 13},
                                                 {PoseFormat::kNclt, "nclt", 7},
                                                 {PoseFormat::kOxford, "oxford", 15},
                                                 {PoseFormat::kNaver, "naver", 16}}};

const FormatInfo& Info(PoseFormat format) { return kFormats[static_cast<std::size_t>(format)]; }

absl::StatusOr<Pose> ParseQuaternion(std::span<const std::string_view> tokens) {
  const absl::StatusOr<std::array<double, 7>> values = ParseValues<7>(tokens);
  if (!values.ok()) return values.status();
  const auto& [tx, ty, tz, qx, qy, qz, qw] = *values;
  return PoseFromQuaternion({tx, ty, tz}, Eigen::Quaterniond(qw, qx, qy, qz));
}

absl::StatusOr<std::int64_t> ParseSeconds(std::string_view token) {
  const std::optional<std::int64_t> ns = ParseSecondsAsNs(token);
  if (!ns) return BadText(absl::StrCat(Quote(token), " is not a time in seconds"));
  return *ns;
}

absl::StatusOr<std::int64_t> ParseNanoseconds(std::string_view token) {
  std::int64_t ns = 0;
  if (!absl::SimpleAtoi(ToAbsl(token), &ns)) {
    return BadText(absl::StrCat(Quote(token), " is not a stamp in whole nanoseconds"));
  }
  return ns;
}

absl::StatusOr<std::int64_t> ParseMicroseconds(std::string_view token) {
  constexpr std::int64_t kMax_us = std::numeric_limits<std::int64_t>::max() / 1000;
  std::int64_t us = 0;
  if (!absl::SimpleAtoi(ToAbsl(token), &us) || us < 0 || us > kMax_us) {
    return BadText(absl::StrCat(Quote(token), " is not a stamp in whole microseconds"));
  }
  return us * 1000;
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

absl::StatusOr<PoseFormat> DetectFormat(std::size_t num_values) {
  if (num_values == kRowOfMatrix) return PoseFormat::kNaver;
  for (const FormatInfo& info : kFormats) {
    if (info.num_values == num_values && info.format != PoseFormat::kAuto) return info.format;
  }
  return BadText(absl::StrCat("cannot tell the format of the poses: the first row has ", num_values,
                              " values; KITTI rows have 12, TUM rows 8, MulRan rows 13, NCLT "
                              "rows 7, Oxford's 15, NAVER LABS's 16 or four times 4"));
}

// Poses of another body become poses of the sensor.
void ApplyMount(const Pose& T_body_sensor, Trajectory& trajectory) {
  const Pose T_map_world =
      trajectory.format == PoseFormat::kKitti ? T_body_sensor.inverse() : Pose::Identity();
  for (Pose& pose : trajectory.T_map_sensor) pose = T_map_world * pose * T_body_sensor;
}

// NAVER LABS: calibration.json stands above the sequences, ROOT/pangyo/train/lidars/poses.txt.
absl::StatusOr<Pose> FindNaverMount(const std::string& poses_file) {
  constexpr int kLevels = 4;
  std::error_code error;
  std::filesystem::path folder = std::filesystem::absolute(poses_file, error).parent_path();
  for (int level = 0; level < kLevels && !error; ++level, folder = folder.parent_path()) {
    const std::filesystem::path calib = folder / "calibration.json";
    if (std::filesystem::is_regular_file(calib, error)) return ReadCalib(calib.string());
    error.clear();
  }
  return BadText(absl::StrCat(poses_file,
                              ": its rows are NAVER LABS's, poses of the vehicle, but there is no "
                              "calibration.json in the folders above; give it as --calib"));
}

absl::StatusOr<Pose> FindMount(const std::string& poses_file, PoseFormat format,
                               const std::string& calib_file) {
  if (!calib_file.empty()) return ReadCalib(calib_file);
  if (format == PoseFormat::kMulran) return MulranOuster();
  if (format == PoseFormat::kNaver) return FindNaverMount(poses_file);
  return Pose::Identity();
}

class TrajectoryReader {
 public:
  explicit TrajectoryReader(PoseFormat format) { trajectory_.format = format; }

  absl::Status Append(const Tokens& row) {
    if (row[0] == "timestamp" && !has_header_ &&
        (format() == PoseFormat::kAuto || format() == PoseFormat::kOxford)) {
      has_header_ = true;
      trajectory_.format = PoseFormat::kOxford;
      return CheckOxfordHeader(row);
    }
    if (format() == PoseFormat::kAuto) {
      const absl::StatusOr<PoseFormat> detected = DetectFormat(row.size());
      if (!detected.ok()) return detected.status();
      trajectory_.format = *detected;
    }
    if (format() == PoseFormat::kOxford && !has_header_) {
      return BadText("ins.csv begins with a header; this is none");
    }
    if (format() == PoseFormat::kNaver) return AppendNaver(row);
    if (absl::Status num = CheckNumValues(row, Info(format()).num_values); !num.ok()) return num;
    if ((format() == PoseFormat::kNclt && HoldsNan(row)) ||
        (format() == PoseFormat::kOxford && !IsGoodOxfordSolution(row))) {
      ++trajectory_.num_left_out;
      return ParseMicroseconds(row[0]).status();
    }
    return AppendPose(ParseRow(format(), row));
  }

  absl::StatusOr<Trajectory> Finish() {
    if (num_values_ != 0) return BadText("ends within a matrix; NAVER LABS's have 16 values");
    if (!trajectory_.T_map_sensor.empty()) return std::move(trajectory_);
    if (trajectory_.num_left_out == 0) return BadText("holds no pose");
    return BadText(absl::StrCat(
        "holds no pose that can be used: none of its ", trajectory_.num_left_out, " rows ",
        format() == PoseFormat::kOxford ? "has the ins_status INS_SOLUTION_GOOD"
                                        : "is without NaN"));
  }

 private:
  [[nodiscard]] PoseFormat format() const { return trajectory_.format; }

  absl::Status AppendPose(const Row& row) {
    if (row.stamp_ns.has_value()) {
      if (!row.stamp_ns->ok()) return row.stamp_ns->status();
      trajectory_.stamps_ns.push_back(**row.stamp_ns);
    }
    if (!row.pose.ok()) return row.pose.status();
    trajectory_.T_map_sensor.push_back(*row.pose);
    return absl::OkStatus();
  }

  // A matrix in one line of 16 values, or in four of 4.
  absl::Status AppendNaver(const Tokens& row) {
    constexpr std::size_t kMatrix = 16;
    const bool fits = row.size() == kRowOfMatrix || (row.size() == kMatrix && num_values_ == 0);
    if (!fits) return CheckNumValues(row, num_values_ == 0 ? kMatrix : kRowOfMatrix);
    for (const std::string_view token : row) {
      const auto value = ParseValues<1>(std::span(&token, 1));
      if (!value.ok()) return value.status();
      matrix_(static_cast<Eigen::Index>(num_values_ / 4),
              static_cast<Eigen::Index>(num_values_ % 4)) = value->front();
      ++num_values_;
    }
    if (num_values_ < kMatrix) return absl::OkStatus();
    num_values_ = 0;
    return AppendPose({PoseFromHomogeneous(matrix_), std::nullopt});
  }

  Trajectory trajectory_;
  bool has_header_ = false;
  Eigen::Matrix4d matrix_ = Eigen::Matrix4d::Zero();
  std::size_t num_values_ = 0;  // of matrix_, read so far
};

}  // namespace

absl::StatusOr<PoseFormat> ParsePoseFormat(std::string_view name) {
  for (const FormatInfo& info : kFormats) {
    if (info.name == name) return info.format;
  }
  return BadText(absl::StrCat("pose format ", Quote(name),
                              " is not auto, kitti, tum, mulran, nclt, oxford or naver"));
}

std::string_view PoseFormatName(PoseFormat format) { return Info(format).name; }

absl::StatusOr<Trajectory> ReadTrajectory(const std::string& poses_file, PoseFormat format,
                                          const std::string& calib_file) try {
  TrajectoryReader reader(format);
  absl::Status status = ForEachRow(poses_file, BlankLines::kOnlyAtEnd,
                                   [&](const Tokens& row) { return reader.Append(row); });
  if (!status.ok()) return status;
  absl::StatusOr<Trajectory> trajectory = reader.Finish();
  if (!trajectory.ok()) return Annotate(trajectory.status(), poses_file);
  const absl::StatusOr<Pose> T_body_sensor = FindMount(poses_file, trajectory->format, calib_file);
  if (!T_body_sensor.ok()) return T_body_sensor.status();
  if (T_body_sensor->matrix() != Pose::Identity().matrix()) ApplyMount(*T_body_sensor, *trajectory);
  return trajectory;
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError(absl::StrCat(poses_file, ": out of memory"));
}

bool MovesLikeACamera(const Trajectory& trajectory) {
  constexpr double kLeastTravel_m = 1.0;
  Eigen::Vector3d travel_m = Eigen::Vector3d::Zero();  // along each axis of the body
  for (std::size_t i = 1; i < trajectory.T_map_sensor.size(); ++i) {
    const Pose& last = trajectory.T_map_sensor[i - 1];
    const Pose& next = trajectory.T_map_sensor[i];
    travel_m += (last.linear().transpose() * (next.translation() - last.translation())).cwiseAbs();
  }
  return travel_m.z() > kLeastTravel_m && travel_m.z() > travel_m.x() + travel_m.y();
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
