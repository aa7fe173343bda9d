#include "scanloc/proto/as_received.hpp"

#include <Eigen/Geometry>

namespace scanloc::proto {

Pose AsReceived(const Pose& pose) {
  const Eigen::Quaterniond sent(pose.linear());
  return PoseFromQuaternion(pose.translation(), sent).value_or(pose);
}

SensorMount AsReceived(SensorMount mount) {
  mount.T_base_sensor = AsReceived(mount.T_base_sensor);
  return mount;
}

void MakeAsReceived(Answer& answer) {
  for (Candidate& candidate : answer.candidates) {
    candidate.T_map_place = AsReceived(candidate.T_map_place);
    candidate.T_map_query = AsReceived(candidate.T_map_query);
  }
}

}  // namespace scanloc::proto
