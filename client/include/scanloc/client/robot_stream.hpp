#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/query.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/proto/messages.hpp"

namespace scanloc::client {

struct StreamOptions {
  std::string map;           ///< empty: the only map there is, not one of several
  Query query;               ///< of every scan
  SensorMount mount = {};    ///< of the sensor, as in RequestOptions
  double max_step_m = 20.0;  ///< without odometry: farthest the robot goes between two scans
  /// Describe scans here and send a server some kilobytes; else 12 bytes a point.
  bool send_descriptor = true;
  std::optional<std::chrono::milliseconds> timeout;  ///< of each scan; none: the client's
  std::chrono::milliseconds budget{0};               ///< of each scan; as in RequestOptions
  std::string request_id;                            ///< of all of it; as in RequestOptions
};

/// One robot that keeps moving: its scans are weighed together (core's Tracker). From
/// LocalizationClient::OpenStream, and may outlive the client. Blocking; one thread at a time.
class RobotStream {
 public:
  /// Who weighs them.
  class Tracking {
   public:
    virtual ~Tracking() = default;
    [[nodiscard]] virtual absl::StatusOr<TrackedReply> Locate(
        PointView scan, const std::optional<Pose>& T_last_scan, const ScanHeader& header) = 0;
    virtual absl::Status Close() { return absl::OkStatus(); }
  };
  explicit RobotStream(std::unique_ptr<Tracking> tracking) : tracking_(std::move(tracking)) {}

  /// Where the robot is, by this scan and those before it. T_last_scan: the pose of this scan in
  /// the sensor frame of the one before, if the robot knows; of the base, where there is a mount.
  /// The header is told again with the reply.
  ///
  /// After an error that is about this scan (InvalidArgument, ResourceExhausted, a map that is
  /// not in service) the stream goes on, and the next T_last_scan is still from this scan. After
  /// DeadlineExceeded, a lost connection or the server's end it is over, which FailedPrecondition
  /// says from then on: open another.
  [[nodiscard]] absl::StatusOr<TrackedReply> Locate(
      PointView scan, const std::optional<Pose>& T_last_scan = std::nullopt,
      const ScanHeader& header = {}) {
    return tracking_->Locate(scan, T_last_scan, header);
  }

  /// Says that no further scan comes, as the end of its life does; OK if the stream ended well.
  absl::Status Close() { return tracking_->Close(); }

 private:
  std::unique_ptr<Tracking> tracking_;
};

}  // namespace scanloc::client
