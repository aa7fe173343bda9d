#include "scanloc/dataset/ros_messages.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "bag/point_field.hpp"
#include "bag/wire_reader.hpp"
#include "decimal_time.hpp"
#include "scan_decoders.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

absl::Status NotWhole() { return absl::InvalidArgumentError("the message is not whole"); }

std::string FrameName(std::string_view name) {
  if (!name.empty() && name.front() == '/') name.remove_prefix(1);
  return std::string(name);
}

MessageHead ReadHead(WireReader& reader) {
  MessageHead head;
  if (reader.is_ros1()) (void)reader.Read<std::uint32_t>();  // sequence
  const std::int64_t seconds = reader.is_ros1() ? std::int64_t{reader.Read<std::uint32_t>()}
                                                : std::int64_t{reader.Read<std::int32_t>()};
  head.stamp_ns = seconds * kNanosecondsPerS + reader.Read<std::uint32_t>();
  head.frame = FrameName(reader.ReadString());
  return head;
}

// geometry_msgs/Pose or Transform; none if it is no pose.
std::optional<Pose> ReadPose(WireReader& reader) {
  std::array<double, 7> v{};
  for (double& value : v) value = reader.Read<double>();
  const absl::StatusOr<Pose> pose =
      PoseFromQuaternion({v[0], v[1], v[2]}, Eigen::Quaterniond(v[6], v[3], v[4], v[5]));
  return pose.ok() ? std::optional(*pose) : std::nullopt;
}

// What a cloud says of its points before they come.
struct CloudLayout {
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::vector<PointField> fields;
  bool is_big_endian = false;
  std::uint32_t point_step = 0;
  std::uint32_t row_step = 0;
};

absl::Status CheckLayout(const CloudLayout& layout, std::size_t num_bytes) {
  const std::uint64_t num_points = std::uint64_t{layout.width} * layout.height;
  if (num_points > limits::kMaxPointsPerScan) {
    return Invalid(absl::StrCat("the cloud announces ", layout.width, " x ", layout.height,
                                " points; a scan has at most ", limits::kMaxPointsPerScan));
  }
  if (num_points == 0) return absl::OkStatus();
  const std::uint64_t row_bytes = std::uint64_t{layout.width} * layout.point_step;
  // Some drivers leave row_step at 0 in clouds of one row.
  const std::uint64_t row_step = layout.height > 1 ? layout.row_step : row_bytes;
  if (row_step < row_bytes || row_step * (layout.height - 1) + row_bytes > num_bytes) {
    return Invalid(absl::StrCat("the cloud announces ", layout.height, " rows of ", layout.width,
                                " points of ", layout.point_step, " bytes, ", layout.row_step,
                                " bytes a row, but holds ", num_bytes, " bytes"));
  }
  for (const PointField& field : layout.fields) {
    if (field.size_bytes() == 0 ||
        std::uint64_t{field.offset} + field.size_bytes() > layout.point_step) {
      return Invalid(absl::StrCat("field ", Quote(field.name), " of the cloud has the type ",
                                  static_cast<int>(field.type), " at ", field.offset, " of the ",
                                  layout.point_step, " bytes of a point"));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<CloudLayout> ReadLayout(WireReader& reader, bool with_intensities) {
  constexpr std::uint32_t kMaxFields = 256;
  CloudLayout layout;
  layout.height = reader.Read<std::uint32_t>();
  layout.width = reader.Read<std::uint32_t>();
  const auto num_fields = reader.Read<std::uint32_t>();
  if (num_fields > kMaxFields) {
    return Invalid(
        absl::StrCat("the cloud announces ", num_fields, " fields; at most ", kMaxFields));
  }
  for (std::uint32_t i = 0; i < num_fields && reader.ok(); ++i) {
    PointField field;
    field.name = reader.ReadString();
    field.offset = reader.Read<std::uint32_t>();
    field.type = reader.Read<std::uint8_t>();
    const auto count = reader.Read<std::uint32_t>();
    // Of padding nothing is read, whatever its type. Some drivers say 0 for one, as PCL takes it.
    const bool is_coordinate = field.name == "x" || field.name == "y" || field.name == "z";
    if ((count > 0 || is_coordinate) && IsReadField(field.name, with_intensities)) {
      layout.fields.push_back(field);
    }
  }
  layout.is_big_endian = reader.Read<std::uint8_t>() != 0;
  layout.point_step = reader.Read<std::uint32_t>();
  layout.row_step = reader.Read<std::uint32_t>();
  if (!reader.ok()) return NotWhole();
  return layout;
}

absl::StatusOr<BinaryLayout> FindCoordinates(const CloudLayout& layout) {
  constexpr std::array<std::string_view, 3> kNames = {"x", "y", "z"};
  BinaryLayout found{.big_endian = layout.is_big_endian};
  for (std::size_t axis = 0; axis < kNames.size(); ++axis) {
    const auto field = std::ranges::find_if(
        layout.fields, [&](const PointField& candidate) { return candidate.name == kNames[axis]; });
    if (field == layout.fields.end() || !field->is_float()) {
      return Invalid(
          absl::StrCat("the cloud has no field ", ToAbsl(kNames[axis]), " of FLOAT32 or FLOAT64"));
    }
    found.xyz[axis] = {field->offset, layout.point_step, FloatOf(field->size_bytes())};
  }
  for (const PointField& field : layout.fields) {
    if (!IsIntensity(field.name) || field.size_bytes() == 0) continue;
    found.intensity = {field.offset, layout.point_step, TypeOf(field)};
    break;
  }
  return found;
}

}  // namespace

absl::StatusOr<MessageHead> DecodeHead(WireFormat format, std::string_view bytes) {
  ASSIGN_OR_RETURN(WireReader reader, WireReader::Create(format, bytes));
  MessageHead head = ReadHead(reader);
  if (!reader.ok()) return NotWhole();
  return head;
}

absl::StatusOr<CloudMessage> DecodeCloud(WireFormat format, std::string_view bytes, bool with_times,
                                         bool with_intensities) {
  ASSIGN_OR_RETURN(WireReader reader, WireReader::Create(format, bytes));
  CloudMessage cloud{.head = ReadHead(reader)};
  ASSIGN_OR_RETURN(const CloudLayout layout, ReadLayout(reader, with_intensities));
  const std::string_view data = reader.ReadBytes();
  if (!reader.ok()) return NotWhole();
  RETURN_IF_ERROR(CheckLayout(layout, data.size()));
  // Without points there need be no fields either.
  if (layout.width == 0 || layout.height == 0) return cloud;
  ASSIGN_OR_RETURN(const BinaryLayout xyz, FindCoordinates(layout));

  const std::size_t row_bytes = std::size_t{layout.width} * layout.point_step;
  const bool is_padded = layout.height > 1 && layout.row_step != row_bytes;
  const std::size_t num_rows = is_padded ? layout.height : 1;
  const std::size_t num_points = is_padded ? layout.width : layout.width * layout.height;
  const PointField* const times = with_times ? FindTimes(layout.fields) : nullptr;
  std::vector<double> values;
  for (std::size_t row = 0; row < num_rows; ++row) {
    const std::string_view rest = data.substr(row * layout.row_step * (is_padded ? 1 : 0));
    Scan read = ReadBinary(xyz, num_points, rest);
    if (times != nullptr) {
      // Of the points that are kept.
      AppendTimes(*times, xyz, num_points, rest, values);
    }
    if (row == 0) {
      cloud.scan = std::move(read);
      continue;
    }
    cloud.scan.points.insert(cloud.scan.points.end(), read.points.begin(), read.points.end());
    cloud.scan.num_not_finite += read.num_not_finite;
    cloud.scan.intensities.insert(cloud.scan.intensities.end(), read.intensities.begin(),
                                  read.intensities.end());
  }
  cloud.offsets_s = OffsetsFromStamp(std::move(values), cloud.head.stamp_ns);
  return cloud;
}

absl::StatusOr<std::optional<GnssFix>> DecodeFix(WireFormat format, std::string_view bytes) {
  ASSIGN_OR_RETURN(WireReader reader, WireReader::Create(format, bytes));
  GnssFix fix{.stamp_ns = ReadHead(reader).stamp_ns};
  const bool is_fix = reader.Read<std::int8_t>() >= 0;
  (void)reader.Read<std::uint16_t>();  // which satellites
  fix.latitude_deg = reader.Read<double>();
  fix.longitude_deg = reader.Read<double>();
  fix.altitude_m = reader.Read<double>();
  if (!reader.ok()) return NotWhole();
  return is_fix ? std::optional(fix) : std::nullopt;
}

bool IsTransformType(std::string_view type) {
  return type == "tf2_msgs/TFMessage" || type == "tf/tfMessage";
}

bool IsPoseType(std::string_view type) {
  return type == "nav_msgs/Odometry" || type == "geometry_msgs/PoseStamped" ||
         type == "geometry_msgs/PoseWithCovarianceStamped" ||
         type == "geometry_msgs/TransformStamped";
}

absl::StatusOr<std::vector<StampedPose>> DecodePoses(std::string_view type, WireFormat format,
                                                     std::string_view bytes, std::size_t& num_bad) {
  ASSIGN_OR_RETURN(WireReader reader, WireReader::Create(format, bytes));
  const std::uint32_t num = IsTransformType(type) ? reader.Read<std::uint32_t>() : 1;
  const bool has_child = IsTransformType(type) || type == "nav_msgs/Odometry" ||
                         type == "geometry_msgs/TransformStamped";
  std::vector<StampedPose> poses;
  for (std::uint32_t i = 0; i < num && reader.ok(); ++i) {
    MessageHead head = ReadHead(reader);
    StampedPose stamped{.stamp_ns = head.stamp_ns, .parent = std::move(head.frame)};
    if (has_child) stamped.child = FrameName(reader.ReadString());
    const std::optional<Pose> pose = ReadPose(reader);
    if (!reader.ok()) break;
    if (pose) {
      stamped.T_parent_child = *pose;
      poses.push_back(std::move(stamped));
    } else {
      ++num_bad;
    }
  }
  if (!reader.ok()) return NotWhole();
  return poses;
}

}  // namespace scanloc::dataset
