// LocalizeStream of the LocalizationService: one robot that keeps moving.
#include <memory>
#include <optional>
#include <utility>

#include "ops/clock.hpp"
#include "rpc/localization_service.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/core/track/tracker.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

/// Nobody is there any more, or nobody who may ask. All else is of one scan.
bool EndsStream(const absl::Status& status) {
  return absl::IsCancelled(status) || absl::IsUnauthenticated(status) ||
         absl::IsPermissionDenied(status);
}

}  // namespace

struct LocalizationService::Robot {
  /// How far it has come since the scan that was last answered.
  struct Motion {
    std::optional<Pose> T_answered_scan = Pose::Identity();  // none: not known
    void Add(const std::optional<Pose>& T_last_scan) {
      if (T_answered_scan && T_last_scan) {
        T_answered_scan = *T_answered_scan * *T_last_scan;
      } else {
        T_answered_scan.reset();
      }
    }
  };

  Call call;
  const grpc::CallbackServerContext* context = nullptr;
  bool is_admitted = false;  // by the rate, for the first scan
  std::optional<v1::StreamConfig> config;
  Asked asked;
  double max_step_m = TrackerOptions().max_step_m;
  std::shared_ptr<const ServedMap> map;
  std::optional<Tracker> tracker;
  std::optional<std::int32_t> last_found;  // place of that map
  Motion motion;
};

RawService::Reactor* LocalizationService::LocalizeStream(grpc::CallbackServerContext* context) {
  const auto robot = std::make_shared<Robot>();
  robot->call = admission_.Begin(*context, "LocalizeStream", Role::kQuery);
  robot->context = context;
  const auto answer = [this, robot](v1::LocalizeStreamRequest& request, std::int64_t arrived_ns,
                                    int worker) -> absl::StatusOr<v1::LocalizeStreamResponse> {
    robot->call.arrived_ns = arrived_ns;
    v1::LocalizeStreamResponse response;
    if (robot->config == std::nullopt) {
      ASSIGN_OR_RETURN(auto opened, Configure(request, *robot));
      *response.mutable_opened() = std::move(opened);
      return response;
    }
    if (!request.has_scan()) {
      return absl::InvalidArgumentError(
          "a stream has one configuration, its first request; all others are scans");
    }
    auto told = AnswerScan(*request.mutable_scan(), Arrival{arrived_ns, NowNs()},
                           describers_[worker], *robot);
    if (EndsStream(told.status())) return told.status();
    admission_.End(robot->call, told.status());
    if (told.ok()) {
      *response.mutable_answer() = *std::move(told);
    } else {
      *response.mutable_error() = proto::ToErrorStatus(told.status());
    }
    return response;
  };
  const auto ended = [this, robot](const absl::Status& status) {
    if (!status.ok()) admission_.End(robot->call, status);  // each answer was seen out
  };
  return streams_.Open({.context = context,
                        .client = robot->call.client,
                        .answer = answer,
                        .ended = ended,
                        .metrics = &metrics_},
                       robot->call.admitted);
}

absl::StatusOr<v1::StreamOpened> LocalizationService::Configure(
    const v1::LocalizeStreamRequest& request, Robot& robot) const {
  if (!request.has_config()) {
    return absl::InvalidArgumentError("the first request of a stream must be its configuration");
  }
  const v1::StreamConfig& config = request.config();
  RETURN_IF_ERROR(proto::CheckAskedMap(config.map()));
  v1::LocalizeRequest query;
  *query.mutable_options() = config.options();
  ASSIGN_OR_RETURN(robot.asked, AskedBy(query));
  if (config.has_max_step_m()) robot.max_step_m = config.max_step_m();
  robot.config = config;
  ASSIGN_OR_RETURN(const auto map, ReadyMap(robot));
  v1::StreamOpened opened;
  opened.set_map(map->info.name);
  opened.set_content_id(map->info.content_id);
  return opened;
}

absl::StatusOr<std::shared_ptr<const ServedMap>> LocalizationService::ReadyMap(Robot& robot) const {
  auto map = maps_.Find(robot.config->map());
  if (!map.ok() || *map == robot.map) return map;
  TrackerOptions tracker_options{.query = robot.asked.query, .max_step_m = robot.max_step_m};
  LimitCandidates((*map)->info.params, limits_.max_candidates, tracker_options.query);
  ASSIGN_OR_RETURN(tracker_options.query.prior,
                   geo::InMapFrame(tracker_options.query.prior, (*map)->geo));
  ASSIGN_OR_RETURN(robot.tracker, Tracker::Create((*map)->localizer, tracker_options));
  robot.map = *map;
  robot.last_found.reset();
  return map;
}

absl::StatusOr<v1::TrackedAnswer> LocalizationService::AnswerScan(v1::StreamScan& scan,
                                                                  const Arrival& arrival,
                                                                  QueryDescriber& describer,
                                                                  Robot& robot) const {
  const auto T_last_scan = proto::OdometryFromProto(scan);
  if (T_last_scan.ok()) {
    robot.motion.Add(*T_last_scan);
  } else {
    robot.motion.Add(std::nullopt);
    return T_last_scan.status();
  }
  // The rate was asked for the first scan when the stream was opened.
  if (std::exchange(robot.is_admitted, true)) {
    RETURN_IF_ERROR(admission_.AdmitNext(robot.call));
  }
  ASSIGN_OR_RETURN(const auto map, ReadyMap(robot));

  v1::LocalizeRequest query;
  query.set_map(robot.config->map());
  *query.mutable_options() = robot.config->options();
  if (scan.has_scan()) query.mutable_scan()->Swap(scan.mutable_scan());
  if (scan.has_descriptors()) query.mutable_descriptors()->Swap(scan.mutable_descriptors());
  query.set_stamp_ns(scan.stamp_ns());
  query.set_frame_id(scan.frame_id());
  ASSIGN_OR_RETURN(auto header, proto::HeaderFromProto(query));
  ASSIGN_OR_RETURN(auto described, describer.Describe(query, *map, limits_.max_points));
  const std::int64_t decode_ns = NowNs() - arrival.started_ns - described.describe_ns;
  std::optional<Pose> T_last = robot.motion.T_answered_scan;
  if (T_last) T_last = TurnedStep(described.mount, *T_last);
  auto told = robot.tracker->Update(described.descriptor, T_last,
                                    ControlOf(*robot.context, robot.asked.budget));
  if (!told.ok()) return ErrorOf(told.status(), *map);
  robot.motion = {};
  told->answer.times.describe_ns = described.describe_ns;
  TellOfBase(described.mount, told->answer);
  geo::TellOnEarth(map->geo, told->answer);
  CountUse(*map, robot.asked.query, told->answer, robot.last_found);
  if (told->answer.outcome == Outcome::kLocalized && !told->answer.candidates.empty()) {
    robot.last_found = told->answer.candidates.front().place;
  }
  const TrackedReply reply{.reply = {.answer = std::move(told->answer),
                                     .map = map->info.name,
                                     .queue_ns = arrival.started_ns - arrival.arrived_ns,
                                     .decode_ns = decode_ns,
                                     .scan_counts = described.scan_counts,
                                     .header = std::move(header)},
                           .num_scans = told->num_scans,
                           .is_relocated = told->is_relocated};
  Show(reply.reply, described, robot.call);
  v1::TrackedAnswer response = proto::ToProto(reply);
  Note(query, reply.reply, response.answer(), robot.call);
  return response;
}

}  // namespace scanloc::server
