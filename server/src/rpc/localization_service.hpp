#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "admission/admission.hpp"
#include "admission/byte_budget.hpp"
#include "admission/idle_calls.hpp"
#include "ops/metrics.hpp"
#include "ops/query_capture.hpp"
#include "ops/recent_answers.hpp"
#include "rpc/inbound_call.hpp"
#include "rpc/query_describer.hpp"
#include "rpc/raw_service.hpp"
#include "rpc/robot_streams.hpp"
#include "scanloc/proto/messages.hpp"
#include "scanloc/server/map_registry.hpp"
#include "scanloc/server/worker_pool.hpp"
#include "scanloc/v1/localization.pb.h"

namespace scanloc::server {

/// Holds what a map of these parameters has a query compare that does not say how much itself to a
/// limit.
void LimitCandidates(const Params& params, int max_candidates, Query& query);

/// scanloc.v1.Localization: queries run on the workers, the others where they arrive.
class LocalizationService final : public RawService {
 public:
  struct Limits {
    RobotStreams::Limits streams;
    std::size_t max_points = 0;
    int max_candidates = 0;
    bool allow_slow_methods = false;
    /// Of requests that run or wait for a worker; half of it for those of streams.
    std::int64_t max_waiting_bytes = 0;
  };

  /// Told that what a query read of a map is damaged; returns once the map is out of service.
  using DamageCallback = std::function<void(const ServedMap& map, const absl::Status& why)>;

  /// All but the limits must outlive the service, the waits of its calls, too; capture may be null.
  LocalizationService(const MapRegistry& maps, WorkerPool& workers, const CallWaits& waits,
                      Admission& admission, Metrics& metrics, QueryCapture* capture,
                      DamageCallback found_damage, RecentAnswers& recent, const Limits& limits);

  [[nodiscard]] int num_streams() const { return streams_.num_open(); }

  /// What the workers' tables may take [bytes].
  [[nodiscard]] std::int64_t work_bytes() const;

  /// Ends the streams, which would else last as long as their robots like.
  void Drain() { streams_.Drain(); }

 private:
  Reactor* Localize(grpc::CallbackServerContext* context);
  Reactor* LocalizeStream(grpc::CallbackServerContext* context);
  Reactor* ListMaps(grpc::CallbackServerContext* context);
  Reactor* GetMapInfo(grpc::CallbackServerContext* context);
  Reactor* ListPlaces(grpc::CallbackServerContext* context);

  /// Whether further requests of the client may be held that wait for a worker.
  [[nodiscard]] absl::Status CheckMemory(const std::string& client) const;

  /// What a worker does for a query.
  [[nodiscard]] absl::Status Serve(InboundCall& inbound, Call& call,
                                   const grpc::CallbackServerContext& context, int worker);

  struct Arrival {
    std::int64_t arrived_ns = 0;  // at the socket
    std::int64_t started_ns = 0;  // on a worker
  };

  [[nodiscard]] absl::StatusOr<LocalizeReply> Answer(const v1::LocalizeRequest& request,
                                                     const Arrival& arrival,
                                                     const grpc::CallbackServerContext& context,
                                                     QueryDescriber& describer, const Call& call);
  /// Ends with the budget, or when nobody waits any more.
  [[nodiscard]] static SearchControl ControlOf(const grpc::CallbackServerContext& context,
                                               std::chrono::milliseconds budget);

  /// What a request asks for, and for how long.
  struct Asked {
    Query query;
    std::chrono::milliseconds budget{0};
  };
  [[nodiscard]] absl::StatusOr<Asked> AskedBy(const v1::LocalizeRequest& request) const;
  /// What a client is told of a search that failed.
  [[nodiscard]] absl::Status ErrorOf(const absl::Status& failed, const ServedMap& map) const;
  [[nodiscard]] absl::Status CheckCost(const Query& query) const;

  /// Notes in the call what was said, counts it, and keeps the query if it found no place.
  void Note(const v1::LocalizeRequest& request, const LocalizeReply& reply,
            const v1::LocalizeResponse& response, Call& call) const;

  /// Counts what was said to a query of the map for its health; last_found as in scanloc::Count.
  static void CountUse(const ServedMap& map, const Query& query, const scanloc::Answer& answer,
                       std::optional<std::int32_t> last_found);

  /// Keeps what was said for those who may see it, where any is kept.
  void Show(const LocalizeReply& reply, const QueryDescriber::Described& described,
            const Call& call) const;

  /// What is known of the robot of one stream. Its requests come one after the other.
  struct Robot;
  [[nodiscard]] absl::StatusOr<v1::StreamOpened> Configure(const v1::LocalizeStreamRequest& request,
                                                           Robot& robot) const;
  [[nodiscard]] absl::StatusOr<v1::TrackedAnswer> AnswerScan(v1::StreamScan& scan,
                                                             const Arrival& arrival,
                                                             QueryDescriber& describer,
                                                             Robot& robot) const;
  /// The robot's map, with a tracker for it that begins anew when the map is another.
  [[nodiscard]] absl::StatusOr<std::shared_ptr<const ServedMap>> ReadyMap(Robot& robot) const;

  const MapRegistry& maps_;
  WorkerPool& workers_;
  const CallWaits waits_;
  Admission& admission_;
  Metrics& metrics_;
  QueryCapture* const capture_;
  const DamageCallback found_damage_;
  RecentAnswers& recent_;
  const Limits limits_;
  std::vector<QueryDescriber> describers_;  // by worker
  ByteBudget waiting_bytes_;
  RobotStreams streams_;
};

}  // namespace scanloc::server
