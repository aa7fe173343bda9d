#include "ros2/ros_wire.hpp"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <cstring>
#include <stdexcept>

namespace scanloc::test {
namespace {

using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

class Writer {
 public:
  Writer() : cdr_(buffer_, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR) { cdr_.serialize_encapsulation(); }

  template <typename Value>
  Writer& operator<<(const Value& value) {
    cdr_ << value;
    return *this;
  }
  Writer& Head(std::int64_t stamp_ns, const std::string& frame) {
    return *this << static_cast<std::int32_t>(stamp_ns / 1'000'000'000)
                 << static_cast<std::uint32_t>(stamp_ns % 1'000'000'000) << frame;
  }
  [[nodiscard]] std::string bytes() const {
    return {buffer_.getBuffer(), cdr_.getSerializedDataLength()};
  }

 private:
  FastBuffer buffer_;
  Cdr cdr_;
};

class Reader {
 public:
  explicit Reader(const std::string& bytes)
      : bytes_(bytes),
        buffer_(bytes_.data(), bytes_.size()),
        cdr_(buffer_, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR) {
    cdr_.read_encapsulation();
  }

  template <typename Value>
  Value Read() {
    Value value{};
    cdr_ >> value;
    return value;
  }
  void ReadHead(PoseHeard& heard) {
    heard.stamp_ns = 1'000'000'000LL * Read<std::int32_t>();
    heard.stamp_ns += Read<std::uint32_t>();
    heard.frame = Read<std::string>();
  }
  Pose ReadPose() {
    std::array<double, 7> v{};
    for (double& value : v) value = Read<double>();
    return PoseFromQuaternion({v[0], v[1], v[2]}, {v[6], v[3], v[4], v[5]}).value();
  }
  void End() const {
    // Padding to a multiple of four may follow.
    if (bytes_.size() - cdr_.getSerializedDataLength() > 3) throw std::runtime_error("too long");
  }

 private:
  std::string bytes_;
  FastBuffer buffer_;
  Cdr cdr_;
};

std::string Cloud(const CloudLies& lies, std::int64_t stamp_ns, const std::string& frame,
                  const std::vector<std::uint8_t>& data, const char* fourth = "intensity") {
  Writer out;
  out.Head(stamp_ns, frame) << lies.height << lies.width << std::uint32_t{4};
  const auto field = [&](const char* name, std::uint32_t offset, std::uint8_t type) {
    out << std::string(name) << offset << type << std::uint32_t{1};
  };
  field("x", 0, 7);
  field("y", 4, 7);
  field("z", lies.z_offset, lies.z_type);
  field(fourth, 12, 7);
  out << false << lies.point_step << lies.point_step * lies.width << data << true;
  return out.bytes();
}

}  // namespace

std::string CloudBytes(const PointCloud& points, std::int64_t stamp_ns, const std::string& frame,
                       const std::vector<float>& times_s) {
  std::vector<std::uint8_t> data(16 * points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::memcpy(data.data() + 16 * i, &points[i], sizeof(Point));
    if (!times_s.empty()) std::memcpy(data.data() + 16 * i + 12, &times_s[i], sizeof(float));
  }
  return Cloud({.width = static_cast<std::uint32_t>(points.size())}, stamp_ns, frame, data,
               times_s.empty() ? "intensity" : "time");
}

std::string LyingCloudBytes(const CloudLies& lies) {
  return Cloud(lies, 1'700'000'000'000'000'000, "lidar", std::vector<std::uint8_t>(16));
}

std::string OdometryBytes(const Pose& T_odom_base, std::int64_t stamp_ns) {
  Writer out;
  out.Head(stamp_ns, "odom") << std::string("base_link");
  const Eigen::Quaterniond q(T_odom_base.linear());
  for (int axis = 0; axis < 3; ++axis) out << T_odom_base.translation()[axis];
  out << q.x() << q.y() << q.z() << q.w() << std::array<double, 36>{};
  out << std::array<double, 6>{} << std::array<double, 36>{};
  return out.bytes();
}

std::string EmptyBytes() { return (Writer() << std::uint8_t{0}).bytes(); }

PoseHeard ReadPoseWithCovariance(const std::string& bytes) {
  Reader in(bytes);
  PoseHeard heard;
  in.ReadHead(heard);
  heard.pose = in.ReadPose();
  heard.covariance = in.Read<std::array<double, 36>>();
  in.End();
  return heard;
}

PoseHeard ReadTransform(const std::string& bytes) {
  Reader in(bytes);
  PoseHeard heard;
  if (in.Read<std::uint32_t>() != 1) throw std::runtime_error("not one transform");
  in.ReadHead(heard);
  heard.child = in.Read<std::string>();
  heard.pose = in.ReadPose();
  in.End();
  return heard;
}

std::vector<Pose> ReadPoseArray(const std::string& bytes) {
  Reader in(bytes);
  PoseHeard head;
  in.ReadHead(head);
  std::vector<Pose> poses(in.Read<std::uint32_t>());
  for (Pose& pose : poses) pose = in.ReadPose();
  in.End();
  return poses;
}

DiagnosisHeard ReadDiagnosis(const std::string& bytes) {
  Reader in(bytes);
  PoseHeard head;
  in.ReadHead(head);
  if (in.Read<std::uint32_t>() != 1) throw std::runtime_error("not one status");
  DiagnosisHeard heard{.level = in.Read<std::uint8_t>()};
  heard.name = in.Read<std::string>();
  heard.message = in.Read<std::string>();
  (void)in.Read<std::string>();  // hardware_id
  for (auto num = in.Read<std::uint32_t>(); num > 0; --num) {
    const auto key = in.Read<std::string>();
    heard.values[key] = in.Read<std::string>();
  }
  in.End();
  return heard;
}

}  // namespace scanloc::test
