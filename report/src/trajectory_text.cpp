#include "scanloc/report/trajectory_text.hpp"

#include "absl/strings/str_format.h"
#include "scanloc/report/csv.hpp"

namespace scanloc::report {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

std::string PoseFields(const Pose& pose) {
  std::vector<std::string> fields;
  AppendPoseFields(pose, &fields);
  std::string text;
  for (const std::string& field : fields) text += " " + field;
  return text;
}

/// From roll, pitch and yaw along the axes of `from` to what g2o has.
Matrix6 InformationOfG2o(const GraphEdge& edge) {
  Matrix6 jacobian = Matrix6::Zero();  // of our error by that of g2o
  jacobian.topLeftCorner<3, 3>() = edge.T_from_to.linear();
  jacobian.bottomRightCorner<3, 3>() = 2.0 * edge.T_from_to.linear();
  return jacobian.transpose() * edge.information * jacobian;
}

}  // namespace

std::string PosesAsKitti(const std::vector<Pose>& poses) {
  std::string text;
  for (const Pose& pose : poses) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) {
        absl::StrAppendFormat(&text, "%.17g%c", pose.matrix()(row, column),
                              row == 2 && column == 3 ? '\n' : ' ');
      }
    }
  }
  return text;
}

std::string TumRow(std::int64_t stamp_ns, const Pose& pose) {
  constexpr std::int64_t kNsPerS = 1'000'000'000;
  std::int64_t seconds = stamp_ns / kNsPerS;
  std::int64_t rest_ns = stamp_ns % kNsPerS;
  const char* sign = stamp_ns < 0 ? "-" : "";
  if (stamp_ns < 0) {
    seconds = -seconds;
    rest_ns = -rest_ns;
  }
  return absl::StrFormat("%s%d.%09d%s\n", sign, seconds, rest_ns, PoseFields(pose));
}

std::string PosesAsTum(const std::vector<std::int64_t>& stamps_ns, const std::vector<Pose>& poses) {
  std::string text;
  for (std::size_t i = 0; i < poses.size(); ++i) text += TumRow(stamps_ns[i], poses[i]);
  return text;
}

std::string GraphAsG2o(const std::vector<Pose>& poses, const std::vector<GraphEdge>& edges) {
  std::string text;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    absl::StrAppendFormat(&text, "VERTEX_SE3:QUAT %d%s\n", i, PoseFields(poses[i]));
  }
  text += "FIX 0\n";
  for (const GraphEdge& edge : edges) {
    absl::StrAppendFormat(&text, "EDGE_SE3:QUAT %d %d%s", edge.from, edge.to,
                          PoseFields(edge.T_from_to));
    const Matrix6 information = InformationOfG2o(edge);
    for (int i = 0; i < 6; ++i) {
      for (int j = i; j < 6; ++j) absl::StrAppendFormat(&text, " %.9g", information(i, j));
    }
    text += '\n';
  }
  return text;
}

}  // namespace scanloc::report
