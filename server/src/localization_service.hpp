#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "metrics.hpp"
#include "query_capture.hpp"
#include "reception.hpp"
#include "robot_streams.hpp"
#include "scanloc/core/descriptor.hpp"
#include "scanloc/core/point_cloud.hpp"
#include "scanloc/proto/messages.hpp"
#include "scanloc/server/map_registry.hpp"
#include "scanloc/server/worker_pool.hpp"
#include "scanloc/v1/localization.grpc.pb.h"

namespace scanloc::server {

/// scanloc.v1.Localization: queries run on the workers, the others where they arrive.
class LocalizationService final
    : public v1::Localization::WithRawCallbackMethod_Localize<
          v1::Localization::WithRawCallbackMethod_LocalizeStream<
              v1::Localization::WithRawCallbackMethod_ListMaps<
                  v1::Localization::WithRawCallbackMethod_GetMapInfo<v1::Localization::Service>>>> {
 public:
  struct Limits {
    int max_streams = 0;
    int max_streams_per_client = 0;  ///< 0: as many
    std::size_t max_points = 0;
    int max_candidates = 0;
  };

  /// All but the limits must outlive the service; capture may be null.
  LocalizationService(const MapRegistry& maps, WorkerPool& workers, Reception& reception,
                      Metrics& metrics, QueryCapture* capture, const Limits& limits);

  [[nodiscard]] int num_streams() const { return streams_.num_open(); }

  /// Ends the streams, which would else last as long as their robots like.
  void Drain() { streams_.Drain(); }

  grpc::ServerUnaryReactor* Localize(grpc::CallbackServerContext* context,
                                     const grpc::ByteBuffer* request,
                                     grpc::ByteBuffer* response) override;
  RobotStreams::Reactor* LocalizeStream(grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* ListMaps(grpc::CallbackServerContext* context,
                                     const grpc::ByteBuffer* request,
                                     grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* GetMapInfo(grpc::CallbackServerContext* context,
                                       const grpc::ByteBuffer* request,
                                       grpc::ByteBuffer* response) override;

 private:
  /// What one worker keeps from query to query.
  struct Scratch {
    PointCloud points;
    std::map<std::string, Describer> describers;  // by signature
  };

  struct Arrival {
    std::int64_t arrived_ns = 0;  // at the socket
    std::int64_t started_ns = 0;  // on a worker
  };

  /// The descriptors of a query, made here or by the robot.
  struct Described {
    ScanDescriptor descriptor;
    std::int64_t describe_ns = 0;
    std::optional<ScanCounts> scan_counts;
  };

  [[nodiscard]] absl::StatusOr<LocalizeReply> Answer(const v1::LocalizeRequest& request,
                                                     const Arrival& arrival,
                                                     const grpc::CallbackServerContext& context,
                                                     Scratch& scratch);
  [[nodiscard]] absl::StatusOr<QueryOptions> OptionsOf(
      const v1::LocalizeRequest& request, const grpc::CallbackServerContext& context) const;
  [[nodiscard]] absl::StatusOr<Described> Describe(const v1::LocalizeRequest& request,
                                                   const ServedMap& map, Scratch& scratch) const;

  /// Notes in the call what was said, counts it, and keeps the query if it found no place.
  void Note(const v1::LocalizeRequest& request, const LocalizeReply& reply,
            const v1::LocalizeResponse& response, Call& call) const;

  /// What is known of the robot of one stream. Its requests come one after the other.
  struct Robot;
  [[nodiscard]] absl::StatusOr<v1::LocalizeStreamResponse> Track(
      const v1::LocalizeStreamRequest& request, const Arrival& arrival, Scratch& scratch,
      Robot& robot) const;

  const MapRegistry& maps_;
  WorkerPool& workers_;
  Reception& reception_;
  Metrics& metrics_;
  QueryCapture* const capture_;
  const Limits limits_;
  std::vector<Scratch> scratch_;  // by worker
  RobotStreams streams_;
};

}  // namespace scanloc::server
