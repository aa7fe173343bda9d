#include "rpc/admin_service.hpp"

#include <memory>
#include <utility>

#include "ops/logs.hpp"
#include "rpc/unary_call.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/v1/admin.pb.h"

namespace scanloc::server {
namespace {

constexpr int kMaxWaiting = 8;

/// Fills in the map as it now is.
template <typename Response>
void Describe(const MapRegistry& maps, const std::string& name, Response& response) {
  for (const MapSummary& map : maps.List()) {
    if (map.name == name) *response.mutable_map() = proto::ToProto(std::vector{map}).maps(0);
  }
}

/// Of a map unloaded there is nothing to tell.
void Describe(const MapRegistry&, const std::string&, v1::UnloadMapResponse&) {}

}  // namespace

AdminService::AdminService(const MapRegistry& maps, const CallWaits& waits, Admission& admission,
                           AdminActions actions)
    : maps_(maps),
      waits_(waits),
      admission_(admission),
      actions_(std::move(actions)),
      worker_(1, kMaxWaiting) {
  Offer<v1::ReloadMapRequest, v1::ReloadMapResponse>("/scanloc.v1.Admin/ReloadMap", "ReloadMap",
                                                     actions_.reload);
  Offer<v1::LoadMapRequest, v1::LoadMapResponse>("/scanloc.v1.Admin/LoadMap", "LoadMap",
                                                 actions_.load);
  Offer<v1::UnloadMapRequest, v1::UnloadMapResponse>("/scanloc.v1.Admin/UnloadMap", "UnloadMap",
                                                     actions_.unload);
}

template <typename Request, typename Response>
void AdminService::Offer(const char* path, const char* method, const Action& action) {
  const auto run = [this, &action](const Request& message, Call& call) -> absl::StatusOr<Response> {
    RETURN_IF_ERROR(proto::CheckAskedMap(message.map()));
    call.map = message.map();
    const absl::Status done = action(message.map());
    LogWith(done.ok() ? spdlog::level::info : spdlog::level::err, "administration",
            {{"method", call.method},
             {"map", message.map()},
             {"by", call.caller.name},
             {"request_id", call.request_id},
             {"result", done.ToString()}});
    if (!done.ok()) return done;
    Response answer;
    Describe(maps_, message.map(), answer);
    return answer;
  };
  Serve(path, [this, method, run](grpc::CallbackServerContext* context) {
    const auto call = std::make_shared<Call>(admission_.Begin(*context, method, Role::kAdmin));
    auto ended = [this, call](const absl::Status& status) { admission_.End(*call, status); };
    if (!call->admitted.ok())
      return InboundCall::Refuse(waits_, *context, call->client, call->admitted, std::move(ended));
    const auto work = [call, context, run](InboundCall& inbound) {
      RETURN_IF_ERROR(CheckStillWanted(*context));
      return Respond<Request>(inbound.request(), inbound.response(),
                              [&](const Request& message) { return run(message, *call); });
    };
    const auto act = [this, call, work](InboundCall& inbound) {
      absl::Status taken = CheckSmall(inbound.request());
      if (taken.ok()) {
        taken = Guard([&] {
          return worker_.Submit(call->client, [&inbound, work](const absl::StatusOr<int>& worker) {
            inbound.End(worker.ok() ? work(inbound) : worker.status());
          });
        });
      }
      if (!taken.ok()) inbound.End(taken);
    };
    return InboundCall::Receive(waits_, *context, call->client, act, std::move(ended));
  });
}

}  // namespace scanloc::server
