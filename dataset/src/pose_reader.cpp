#include "scanloc/dataset/pose_reader.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <limits>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "decimal_time.hpp"
#include "file_bytes.hpp"
#include "pose_format.hpp"
#include "pose_rows.hpp"
#include "published_poses.hpp"
#include "quaternion_rows.hpp"
#include "scan_list.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

/// Rows of 4x4 matrices, each in one line of 16 values or in four of 4.
class MatrixRows {
 public:
  /// Appends a pose to the trajectory, of kNaver or kMatrix, when its last value is there.
  [[nodiscard]] absl::Status Append(const Tokens& row, Trajectory& trajectory) {
    constexpr std::size_t kMatrix = 16;
    constexpr std::size_t kLine = 4;
    const bool fits = row.size() == kLine || (row.size() == kMatrix && num_values_ == 0);
    if (!fits) return CheckNumValues(row, num_values_ == 0 ? kMatrix : kLine);
    for (const std::string_view token : row) {
      ASSIGN_OR_RETURN(const auto value, ParseValues<1>(std::span(&token, 1)));
      values_(static_cast<Eigen::Index>(num_values_ / kLine),
              static_cast<Eigen::Index>(num_values_ % kLine)) = value.front();
      ++num_values_;
    }
    if (num_values_ < kMatrix) return absl::OkStatus();
    num_values_ = 0;
    if (trajectory.format == PoseFormat::kMatrix) {
      corners_.emplace_back(row.back());
      are_corners_one_ &= values_(3, 3) == 1.0;
      values_(3, 3) = 1.0;
    }
    ASSIGN_OR_RETURN(const Pose pose, PoseFromHomogeneous(values_));
    trajectory.T_map_sensor.push_back(pose);
    return absl::OkStatus();
  }

  /// Appends the stamps, if kMatrix has them where the 1 of a matrix stands.
  [[nodiscard]] absl::Status Finish(Trajectory& trajectory) const {
    if (num_values_ != 0) return Invalid("ends within a matrix; 4x4 ones have 16 values");
    if (are_corners_one_) return absl::OkStatus();
    const TimeUnit unit = LikelyUnit(corners_.front());
    for (const std::string& corner : corners_) {
      const std::optional<std::int64_t> ns = ParseTimeAsNs(corner, unit);
      const std::vector<std::int64_t>& stamps_ns = trajectory.stamps_ns;
      if (!ns || (!stamps_ns.empty() && *ns <= stamps_ns.back())) {
        return Invalid(absl::StrCat("the last row of matrix ", stamps_ns.size(),
                                    " is not 0 0 0 1, and ", Quote(corner),
                                    " is no time later than that of the matrix before"));
      }
      trajectory.stamps_ns.push_back(*ns);
    }
    return absl::OkStatus();
  }

 private:
  Eigen::Matrix4d values_ = Eigen::Matrix4d::Zero();
  std::size_t num_values_ = 0;  // read so far
  bool are_corners_one_ = true;
  std::vector<std::string> corners_;  // last value of each matrix, as written
};

absl::StatusOr<std::int64_t> ParseNanoseconds(std::string_view token) {
  std::int64_t ns = 0;
  if (!absl::SimpleAtoi(ToAbsl(token), &ns)) {
    return Invalid(absl::StrCat(Quote(token), " is not a stamp in whole nanoseconds"));
  }
  return ns;
}

absl::StatusOr<std::int64_t> ParseMicroseconds(std::string_view token) {
  constexpr std::int64_t kMax_us = std::numeric_limits<std::int64_t>::max() / 1000;
  std::int64_t us = 0;
  if (!absl::SimpleAtoi(ToAbsl(token), &us) || us < 0 || us > kMax_us) {
    return Invalid(absl::StrCat(Quote(token), " is not a stamp in whole microseconds"));
  }
  return us * 1000;
}

bool HoldsNan(const Tokens& row) {
  return std::ranges::any_of(
      row, [](std::string_view token) { return absl::EqualsIgnoreCase(ToAbsl(token), "nan"); });
}

// A row without its stamp, and the stamp if the format has one.
struct Row {
  absl::StatusOr<Pose> pose;
  std::optional<absl::StatusOr<std::int64_t>> stamp_ns;
};

Row ParseRow(PoseFormat format, std::span<const std::string_view> tokens) {
  switch (format) {
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

// Poses of another body become poses of the sensor.
void ApplyMount(const Pose& T_body_sensor, bool is_of_camera, Trajectory& trajectory) {
  const Pose T_map_world = is_of_camera ? T_body_sensor.inverse() : Pose::Identity();
  for (Pose& pose : trajectory.T_map_sensor) pose = T_map_world * pose * T_body_sensor;
}

class TrajectoryReader {
 public:
  TrajectoryReader(PoseFormat format, bool has_naver_calib)
      : is_guess_(format == PoseFormat::kAuto), has_naver_calib_(has_naver_calib) {
    trajectory_.format = format;
  }

  // Only above the rows a comment can be a headline.
  absl::Status AppendComment(const TextRow& comment) {
    if (!MayBeQuaternions() || num_rows_ > 0) return absl::OkStatus();
    if (const auto named = ReadHeadline(comment.values)) named_in_comment_ = named;
    return absl::OkStatus();
  }

  absl::Status Append(const TextRow& row) {
    if (num_rows_++ == 0 && IsHeadline(row.values)) return AppendHeadline(row);
    if (quaternions_) return quaternions_->Append(row);
    if (named_in_comment_ && named_in_comment_->num_values == row.values.size()) {
      has_headline_ = true;
      return StartQuaternions(std::exchange(named_in_comment_, std::nullopt), row);
    }
    named_in_comment_.reset();
    if (format() == PoseFormat::kAuto) {
      ASSIGN_OR_RETURN(const PoseFormat detected, DetectFormat(row, has_naver_calib_));
      trajectory_.format = detected;
      if (detected == PoseFormat::kTum) return StartQuaternions(std::nullopt, row);
    }
    switch (format()) {
      case PoseFormat::kTum:
        return StartQuaternions(TumColumns(), row);
      case PoseFormat::kNaver:
      case PoseFormat::kMatrix:
        return matrices_.Append(row.values, trajectory_);
      case PoseFormat::kKitti360:
        return AppendNumbered(row.values);
      default:
        return AppendRow(row.values);
    }
  }

  absl::StatusOr<Trajectory> Finish(const std::string& file) {
    if (quaternions_) {
      absl::StatusOr<Trajectory> read = quaternions_->Finish(file);
      if (!read.ok()) return read;
      read->notes[0] = absl::StrCat(read->notes[0], has_headline_ ? ", as the headline says" : "");
      trajectory_ = *std::move(read);
    }
    if (absl::Status status = matrices_.Finish(trajectory_); !status.ok()) {
      return Annotate(status, file);
    }
    if (!trajectory_.T_map_sensor.empty()) return std::move(trajectory_);
    if (trajectory_.num_left_out == 0) return Invalid(absl::StrCat(file, ": holds no pose"));
    return Invalid(absl::StrCat(
        file, ": holds no pose that can be used: none of its ", trajectory_.num_left_out, " rows ",
        format() == PoseFormat::kOxford ? "has the ins_status INS_SOLUTION_GOOD"
                                        : "is without NaN"));
  }

  // Whether a user should be told how the file was read: twelve values can only be KITTI's.
  [[nodiscard]] bool is_guess() const {
    return (is_guess_ && format() != PoseFormat::kKitti) || has_headline_;
  }

 private:
  [[nodiscard]] PoseFormat format() const { return trajectory_.format; }
  [[nodiscard]] bool MayBeQuaternions() const {
    return format() == PoseFormat::kAuto || format() == PoseFormat::kTum;
  }

  absl::Status AppendHeadline(const TextRow& row) {
    has_headline_ = true;
    const Tokens& names = row.values;
    const bool is_oxford = std::ranges::find(names, "ins_status") != names.end();
    if (format() == PoseFormat::kOxford || (format() == PoseFormat::kAuto && is_oxford)) {
      trajectory_.format = PoseFormat::kOxford;
      return CheckOxfordHeader(names);
    }
    const std::optional<PoseColumns> named = ReadHeadline(names);
    if (MayBeQuaternions() && named) quaternions_.emplace(named);
    return absl::OkStatus();
  }

  absl::Status StartQuaternions(std::optional<PoseColumns> columns, const TextRow& row) {
    return quaternions_.emplace(std::move(columns)).Append(row);
  }

  absl::Status AppendRow(const Tokens& row) {
    if (format() == PoseFormat::kOxford && !has_headline_) {
      return Invalid("ins.csv begins with a headline; this is none");
    }
    RETURN_IF_ERROR(CheckNumValues(row, NumValues(format())));
    if ((format() == PoseFormat::kNclt && HoldsNan(row)) ||
        (format() == PoseFormat::kOxford && !IsGoodOxfordSolution(row))) {
      ++trajectory_.num_left_out;
      return ParseMicroseconds(row[0]).status();
    }
    return AppendPose(ParseRow(format(), row));
  }

  absl::Status AppendPose(const Row& row) {
    if (row.stamp_ns.has_value()) {
      if (!row.stamp_ns->ok()) return row.stamp_ns->status();
      trajectory_.stamps_ns.push_back(**row.stamp_ns);
    }
    if (!row.pose.ok()) return row.pose.status();
    trajectory_.T_map_sensor.push_back(*row.pose);
    return absl::OkStatus();
  }

  // KITTI-360: the number of a frame, and [R t] in 12 values or a 4x4 matrix in 16.
  absl::Status AppendNumbered(const Tokens& row) {
    std::int64_t number = 0;
    if (!IsNumber(row[0]) || !absl::SimpleAtoi(ToAbsl(row[0]), &number)) {
      return Invalid(absl::StrCat(Quote(row[0]), " is not the number of a frame"));
    }
    if (row.size() != 13) {
      RETURN_IF_ERROR(CheckNumValues(row, 17));
    }
    trajectory_.frame_numbers.push_back(number);
    return AppendPose({ParseMatrix(std::span(row).subspan(1, 12)), std::nullopt});
  }

  bool is_guess_;
  bool has_naver_calib_;
  Trajectory trajectory_;
  std::size_t num_rows_ = 0;
  bool has_headline_ = false;
  std::optional<PoseColumns> named_in_comment_;
  std::optional<QuaternionRows> quaternions_;
  MatrixRows matrices_;
};

}  // namespace

absl::StatusOr<Trajectory> ReadTrajectory(const std::string& poses_file, PoseFormat format,
                                          const std::string& calib_file,
                                          const std::optional<Pose>& T_body_sensor) try {
  const std::string naver_calib = FindNaverCalib(poses_file);
  TrajectoryReader reader(format, !naver_calib.empty());
  absl::Status status = ForEachRow(
      poses_file, BlankLines::kOnlyAtEnd, [&](const TextRow& row) { return reader.Append(row); },
      [&](const TextRow& comment) { return reader.AppendComment(comment); });
  if (!status.ok()) return status;
  absl::StatusOr<Trajectory> trajectory = reader.Finish(poses_file);
  if (!trajectory.ok()) return trajectory;
  const absl::StatusOr<PoseMount> mount =
      T_body_sensor ? PoseMount{*T_body_sensor, "the rows are taken for poses of the base"}
                    : FindMount(trajectory->format, calib_file, naver_calib);
  if (!mount.ok()) {
    return calib_file.empty() && naver_calib.empty() ? Annotate(mount.status(), poses_file)
                                                     : mount.status();
  }
  const bool is_applied = mount->T_body_sensor.matrix() != Pose::Identity().matrix();
  if (is_applied) {
    const bool is_of_camera = trajectory->format == PoseFormat::kKitti && !T_body_sensor;
    ApplyMount(mount->T_body_sensor, is_of_camera, *trajectory);
  }
  const std::string columns =
      trajectory->notes.empty() ? "" : absl::StrCat(" (", trajectory->notes[0], ")");
  trajectory->notes.clear();
  if (reader.is_guess() || mount->is_of_format) {
    trajectory->notes.push_back(absl::StrCat(poses_file, " is read as ",
                                             ToAbsl(PoseFormatName(trajectory->format)), columns,
                                             ": ", mount->note));
  }
  if (trajectory->num_left_out > 0) {
    trajectory->notes.push_back(absl::StrCat(trajectory->num_left_out, " rows of ", poses_file,
                                             " are left out: they hold no good pose"));
  }
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
  TimeUnit unit = TimeUnit::kSeconds;
  absl::Status status =
      ForEachRow(times_file, BlankLines::kOnlyAtEnd, [&](const TextRow& row) -> absl::Status {
        RETURN_IF_ERROR(CheckNumValues(row.values, 1));
        if (stamps_ns.empty()) unit = LikelyUnit(row.values[0]);
        const std::optional<std::int64_t> ns = ParseTimeAsNs(row.values[0], unit);
        if (!ns) {
          return Invalid(
              absl::StrCat(Quote(row.values[0]), " is not a time in ", ToAbsl(TimeUnitName(unit))));
        }
        stamps_ns.push_back(*ns);
        return absl::OkStatus();
      });
  if (!status.ok()) return status;
  return stamps_ns;
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError(absl::StrCat(times_file, ": out of memory"));
}

}  // namespace scanloc::dataset
