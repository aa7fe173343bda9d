#include "rpc/localization_service.hpp"

#include <google/protobuf/util/time_util.h>

#include <utility>

#include "ops/clock.hpp"
#include "rpc/small_call.hpp"
#include "rpc/unary_call.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/status.hpp"
#include "scanloc/server/build_info.hpp"

namespace scanloc::server {
namespace {

constexpr double kMemoryRetry_s = 0.2;

RobotStreams::Limits WithBytes(RobotStreams::Limits limits, std::int64_t max_bytes) {
  limits.max_bytes = max_bytes;
  return limits;
}

}  // namespace

LocalizationService::LocalizationService(const MapRegistry& maps, WorkerPool& workers,
                                         const CallWaits& waits, Admission& admission,
                                         Metrics& metrics, QueryCapture* capture,
                                         DamageCallback found_damage, RecentAnswers& recent,
                                         const Limits& limits)
    : maps_(maps),
      workers_(workers),
      waits_(waits),
      admission_(admission),
      metrics_(metrics),
      capture_(capture),
      found_damage_(std::move(found_damage)),
      recent_(recent),
      limits_(limits),
      describers_(workers.num_threads()),
      waiting_bytes_(limits.max_waiting_bytes / 2),
      streams_(workers, WithBytes(limits.streams, limits.max_waiting_bytes / 2)) {
  using Context = grpc::CallbackServerContext;
  RawService::Serve("/scanloc.v1.Localization/Localize",
                    [this](Context* context) { return Localize(context); });
  RawService::Serve("/scanloc.v1.Localization/LocalizeStream",
                    [this](Context* context) { return LocalizeStream(context); });
  RawService::Serve("/scanloc.v1.Localization/ListMaps",
                    [this](Context* context) { return ListMaps(context); });
  RawService::Serve("/scanloc.v1.Localization/GetMapInfo",
                    [this](Context* context) { return GetMapInfo(context); });
  RawService::Serve("/scanloc.v1.Localization/ListPlaces",
                    [this](Context* context) { return ListPlaces(context); });
}

std::int64_t LocalizationService::work_bytes() const {
  std::int64_t sum = 0;
  for (const QueryDescriber& describer : describers_) sum += describer.held_bytes();
  return sum;
}

absl::Status LocalizationService::CheckMemory(const std::string& client) const {
  if (!waiting_bytes_.IsOverdrawnFor(client)) return absl::OkStatus();
  return proto::WithRetryAfter(
      absl::ResourceExhaustedError("the requests that wait fill the memory meant for them, or this "
                                   "client's part of it; try again later"),
      kMemoryRetry_s);
}

RawService::Reactor* LocalizationService::Localize(grpc::CallbackServerContext* context) {
  const auto call = std::make_shared<Call>(admission_.Begin(*context, "Localize", Role::kQuery));
  auto ended = [this, call](const absl::Status& status) { admission_.End(*call, status); };
  if (!call->admitted.ok())
    return InboundCall::Refuse(waits_, *context, call->client, call->admitted, std::move(ended));
  // What would be refused need not be received first.
  absl::Status room = CheckMemory(call->client);
  if (room.ok()) room = workers_.CheckRoomFor(call->client);
  if (!room.ok()) {
    metrics_.CountRejected("busy");
    return InboundCall::Refuse(waits_, *context, call->client, room, std::move(ended));
  }
  const auto act = [this, call, context](InboundCall& inbound) {
    call->arrived_ns = NowNs();  // how long the client took to send it is not the server's time
    ByteBudget::Share share(waiting_bytes_, call->client,
                            static_cast<std::int64_t>(inbound.request().Length()));
    absl::Status taken = CheckMemory(call->client);
    if (taken.ok()) {
      taken = Guard([&] {
        return workers_.Submit(
            call->client, [this, call, context, &inbound,
                           share = std::move(share)](const absl::StatusOr<int>& worker) {
              if (!worker.ok()) metrics_.CountRejected("busy");
              inbound.End(worker.ok() ? Serve(inbound, *call, *context, *worker) : worker.status());
            });
      });
    }
    if (taken.ok()) return;
    metrics_.CountRejected("busy");
    inbound.End(taken);
  };
  return InboundCall::Receive(waits_, *context, call->client, act, std::move(ended));
}

absl::Status LocalizationService::Serve(InboundCall& inbound, Call& call,
                                        const grpc::CallbackServerContext& context, int worker) {
  RETURN_IF_ERROR(CheckStillWanted(context));
  const Arrival arrival{call.arrived_ns, NowNs()};
  return Respond<v1::LocalizeRequest>(
      inbound.request(), inbound.response(),
      [&](const v1::LocalizeRequest& message) -> absl::StatusOr<v1::LocalizeResponse> {
        ASSIGN_OR_RETURN(const auto reply,
                         Answer(message, arrival, context, describers_[worker], call));
        v1::LocalizeResponse told = proto::ToProto(reply);
        Note(message, reply, told, call);
        return told;
      });
}

void LocalizationService::Note(const v1::LocalizeRequest& request, const LocalizeReply& reply,
                               const v1::LocalizeResponse& response, Call& call) const {
  call.map = reply.map;
  call.content_id = reply.answer.content_id;
  call.outcome = reply.answer.outcome;
  metrics_.AddReply(reply);
  // A scan of next to nothing tells nothing, and whoever sends such could push the others out.
  if (capture_ == nullptr || reply.answer.outcome == Outcome::kLocalized ||
      reply.answer.outcome == Outcome::kInsufficientScan) {
    return;
  }
  v1::CapturedQuery query;
  query.set_request_id(call.request_id);
  query.set_server_version(BuildVersion());
  *query.mutable_received() = google::protobuf::util::TimeUtil::GetCurrentTime();
  *query.mutable_request() = request;
  *query.mutable_response() = response;
  capture_->Keep(std::move(query));
}

RawService::Reactor* LocalizationService::ListMaps(grpc::CallbackServerContext* context) {
  return AnswerHere<v1::ListMapsRequest>(
      waits_, admission_, "ListMaps", Role::kQuery, context,
      [this](const v1::ListMapsRequest&) -> absl::StatusOr<v1::ListMapsResponse> {
        return proto::ToProto(maps_.List());
      });
}

RawService::Reactor* LocalizationService::GetMapInfo(grpc::CallbackServerContext* context) {
  return AnswerHere<v1::GetMapInfoRequest>(
      waits_, admission_, "GetMapInfo", Role::kQuery, context,
      [this](const v1::GetMapInfoRequest& message) -> absl::StatusOr<v1::GetMapInfoResponse> {
        RETURN_IF_ERROR(proto::CheckAskedMap(message.map()));
        ASSIGN_OR_RETURN(const auto map, maps_.Find(message.map()));
        v1::GetMapInfoResponse result;
        *result.mutable_info() = proto::ToProto(map->info);
        return result;
      });
}

RawService::Reactor* LocalizationService::ListPlaces(grpc::CallbackServerContext* context) {
  return AnswerHere<v1::ListPlacesRequest>(
      waits_, admission_, "ListPlaces", Role::kQuery, context,
      [this](const v1::ListPlacesRequest& message) -> absl::StatusOr<v1::ListPlacesResponse> {
        RETURN_IF_ERROR(proto::CheckAskedMap(message.map()));
        ASSIGN_OR_RETURN(const auto map, maps_.Find(message.map()));
        ASSIGN_OR_RETURN(auto page, PageOfPlaces(map->localizer->map(), message.page_size(),
                                                 message.page_token()));
        if (map->geo) page.geo = map->geo->ToGeo(page.places);
        return proto::ToProto(page);
      });
}

}  // namespace scanloc::server
