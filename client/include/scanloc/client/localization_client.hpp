#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/client/robot_stream.hpp"
#include "scanloc/core/query.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/proto/messages.hpp"

namespace scanloc::client {

/// What one query may say beside the scan.
struct RequestOptions {
  /// Empty: all maps that there are. Each candidate then tells its map, and an equally good place
  /// in another map makes the answer ambiguous; a prior but Prior::on_earth needs the name of its
  /// map.
  std::string map;
  Query query;
  /// How the sensor that saw the scan sits on its robot; poses told are those of the base. Not for
  /// descriptors made beforehand.
  SensorMount mount = {};
  ScanHeader header = {};                            ///< of the scan; the reply has it, too
  std::optional<std::chrono::milliseconds> timeout;  ///< none: the client's
  /// With `auto`: verification ends after so long, with the best answer so far; 0: when it is done.
  std::chrono::milliseconds budget{0};
  /// What a server's log and answers know the call by: up to 128 printable characters without
  /// spaces; empty: the server makes one. Sent as the metadata x-request-id.
  std::string request_id;
};

/// Who answers wake-up queries: a server (Client), or a map file in this process (OfflineClient).
/// The same map gives the same answer either way. Thread-safe.
class LocalizationClient {
 public:
  LocalizationClient() = default;
  LocalizationClient(const LocalizationClient&) = default;
  LocalizationClient& operator=(const LocalizationClient&) = default;
  LocalizationClient(LocalizationClient&&) = default;
  LocalizationClient& operator=(LocalizationClient&&) = default;
  virtual ~LocalizationClient() = default;

  [[nodiscard]] virtual absl::StatusOr<std::vector<MapSummary>> ListMaps() const = 0;

  /// An empty name stands for the only map.
  [[nodiscard]] virtual absl::StatusOr<MapInfo> GetMapInfo(const std::string& map = "") const = 0;

  /// The places of a map from the one that the token names on; see PageOfPlaces.
  [[nodiscard]] virtual absl::StatusOr<PlacesPage> ListPlaces(
      const std::string& map = "", const std::string& page_token = "") const = 0;

  /// A server is sent the scan as it is: 12 bytes a point.
  [[nodiscard]] virtual absl::StatusOr<LocalizeReply> LocalizeScan(
      PointView scan, const RequestOptions& options = {}) const = 0;

  /// Describes the scan here, so that a server is sent some kilobytes; the answer is the same as
  /// LocalizeScan's.
  [[nodiscard]] virtual absl::StatusOr<LocalizeReply> LocalizeByDescriptor(
      PointView scan, const RequestOptions& options = {}) const {
    return LocalizeScan(scan, options);
  }

  /// Descriptors that were made with the map's parameters (GetMapInfo, Describer).
  /// FailedPrecondition if they were made with others.
  [[nodiscard]] virtual absl::StatusOr<LocalizeReply> LocalizeDescriptor(
      const SignedDescriptor& descriptor, const RequestOptions& options = {}) const = 0;

  /// For a robot that keeps moving. The map is there and the options are good, or it is an error.
  [[nodiscard]] virtual absl::StatusOr<RobotStream> OpenStream(
      const StreamOptions& options = {}) const = 0;
};

}  // namespace scanloc::client
