#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"

/// Messages of ROS to and from CDR by eProsima's Fast CDR: what the program says is read by code
/// that is not ours, and what it hears was written by such.
namespace scanloc::test {

/// A sensor_msgs/PointCloud2 with x, y, z of FLOAT32 and an intensity, or the times given [s after
/// the stamp].
std::string CloudBytes(const PointCloud& points, std::int64_t stamp_ns,
                       const std::string& frame = "base_link",
                       const std::vector<float>& times_s = {});

/// How a cloud may lie about itself.
struct CloudLies {
  std::uint32_t height = 1;
  std::uint32_t width = 1;
  std::uint32_t point_step = 16;
  std::uint32_t z_offset = 8;
  std::uint8_t z_type = 7;
};
/// A cloud of one point that says so.
std::string LyingCloudBytes(const CloudLies& lies);

/// A nav_msgs/Odometry of base_link in odom.
std::string OdometryBytes(const Pose& T_odom_base, std::int64_t stamp_ns);

std::string EmptyBytes();

struct PoseHeard {
  std::int64_t stamp_ns = 0;
  std::string frame;
  std::string child;  ///< of a transform
  Pose pose = Pose::Identity();
  std::array<double, 36> covariance{};
};
/// These throw std::exception if the bytes are no such message, whole.
PoseHeard ReadPoseWithCovariance(const std::string& bytes);
PoseHeard ReadTransform(const std::string& bytes);  ///< the only one of a TFMessage
std::vector<Pose> ReadPoseArray(const std::string& bytes);

struct DiagnosisHeard {
  int level = 0;
  std::string name;
  std::string message;
  std::map<std::string, std::string> values;
};
DiagnosisHeard ReadDiagnosis(const std::string& bytes);

}  // namespace scanloc::test
