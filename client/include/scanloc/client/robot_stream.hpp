#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/query.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/proto/messages.hpp"

namespace scanloc::client {

struct StreamOptions {
  std::string map;           ///< empty: the server's only map
  Query query;               ///< of every scan
  double max_step_m = 20.0;  ///< without odometry: farthest the robot goes between two scans
  /// Describe scans here and send some kilobytes; else send them as they are, 12 bytes a point.
  bool send_descriptor = true;
  std::optional<std::chrono::milliseconds> timeout;  ///< of each scan; none: the client's
  std::chrono::milliseconds budget{0};               ///< of each scan; as in RequestOptions
  std::string request_id;                            ///< of all of it; as in RequestOptions
};

/// One robot that keeps moving: the server weighs its scans together (core's Tracker). From
/// Client::OpenStream, and outlives the client. Blocking; one thread at a time.
class RobotStream {
 public:
  RobotStream(RobotStream&&) noexcept;
  RobotStream& operator=(RobotStream&&) noexcept;
  ~RobotStream();  ///< Close

  /// Where the robot is, by this scan and those before it. T_last_scan: the pose of this scan in
  /// the sensor frame of the one before, if the robot knows.
  ///
  /// After an error, DeadlineExceeded among them, the stream is over: open another.
  [[nodiscard]] absl::StatusOr<TrackedReply> Locate(
      PointView scan, const std::optional<Pose>& T_last_scan = std::nullopt);

  /// Says that no further scan comes; OK if the stream ended well.
  absl::Status Close();

 private:
  friend class Client;
  struct State;
  explicit RobotStream(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace scanloc::client
