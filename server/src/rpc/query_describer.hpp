#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/server/map_registry.hpp"
#include "scanloc/v1/localization.pb.h"

namespace scanloc::server {

/// Makes or takes the descriptors of queries. Keeps its memory from query to query, unless a scan
/// took much more than scans do; one a worker.
class QueryDescriber {
 public:
  struct Described {
    ScanDescriptor descriptor;
    std::int64_t describe_ns = 0;
    std::optional<ScanCounts> scan_counts;  ///< where the query is a scan
    SensorMount mount = {};  ///< of the sensor: the descriptor is of its turned frame
  };

  /// Of a query to the map. InvalidArgument if it has neither scan nor descriptors or a malformed
  /// one, ResourceExhausted beyond max_points, FailedPrecondition if the descriptors were made with
  /// other parameters than the map's.
  [[nodiscard]] absl::StatusOr<Described> Describe(const v1::LocalizeRequest& request,
                                                   const ServedMap& map, std::size_t max_points);

  /// What its tables may take now [bytes]. From any thread.
  [[nodiscard]] std::int64_t held_bytes() const { return held_bytes_; }

 private:
  [[nodiscard]] absl::StatusOr<Described> DescribeScan(const v1::ScanPoints& scan,
                                                       const ServedMap& map,
                                                       std::size_t max_points);
  [[nodiscard]] absl::StatusOr<Describer*> DescriberFor(const ServedMap& map);

  /// Lets go of what a large scan made large, of the other maps' tables first.
  void KeepWhatIsUsual(const std::string& last_used);

  PointCloud points_;
  std::map<std::string, Describer> describers_;  // by signature
  std::atomic<std::int64_t> held_bytes_ = 0;
};

}  // namespace scanloc::server
