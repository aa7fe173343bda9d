#pragma once

#include "scanloc/core/answer.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"

namespace scanloc::proto {

/// A pose, or the poses of an answer, with the bits that they arrive with over the wire, where
/// rotations are quaternions. For who answers in place what a server would answer.
[[nodiscard]] Pose AsReceived(const Pose& pose);
[[nodiscard]] SensorMount AsReceived(SensorMount mount);
void MakeAsReceived(Answer& answer);

}  // namespace scanloc::proto
