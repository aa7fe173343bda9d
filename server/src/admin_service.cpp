#include "admin_service.hpp"

#include <memory>
#include <string>
#include <utility>

#include "logs.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/status.hpp"
#include "unary_call.hpp"

namespace scanloc::server {
namespace {

constexpr int kMaxWaiting = 8;
constexpr std::size_t kMaxRequestBytes = 4096;

absl::Status CheckRequest(const grpc::ByteBuffer& request) {
  if (request.Valid() && request.Length() <= kMaxRequestBytes) return absl::OkStatus();
  return absl::InvalidArgumentError("the request is none, or too long for one");
}

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

AdminService::AdminService(const MapRegistry& maps, Reception& reception, AdminActions actions)
    : maps_(maps), reception_(reception), actions_(std::move(actions)), worker_(1, kMaxWaiting) {}

template <typename Request, typename Response>
grpc::ServerUnaryReactor* AdminService::Run(grpc::CallbackServerContext* context,
                                            const grpc::ByteBuffer* request,
                                            grpc::ByteBuffer* response, const char* method,
                                            const Action& action) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const auto call = std::make_shared<Call>(reception_.Begin(*context, method, Role::kAdmin));
  const auto finish = [this, reactor, call](const absl::Status& status) {
    reception_.End(*call, status);
    reactor->Finish(proto::ToGrpc(status));
  };
  absl::Status taken = call->admitted;
  if (taken.ok()) taken = CheckRequest(*request);
  if (taken.ok()) {
    taken = Guard([&] {
      return worker_.Submit(
          call->client, [=, &maps = maps_, &action](const absl::StatusOr<int>& worker) {
            absl::Status status = worker.status();
            if (status.ok()) status = CheckStillWanted(*context);
            if (status.ok()) {
              status = Respond<Request>(
                  *request, response, [&](const Request& message) -> absl::StatusOr<Response> {
                    if (auto name = proto::CheckMapName(message.map()); !name.ok()) return name;
                    call->map = message.map();
                    const absl::Status done = action(message.map());
                    LogWith(done.ok() ? spdlog::level::info : spdlog::level::err, "administration",
                            {{"method", call->method},
                             {"map", message.map()},
                             {"by", call->caller.name},
                             {"request_id", call->request_id},
                             {"result", done.ToString()}});
                    if (!done.ok()) return done;
                    Response answer;
                    Describe(maps, message.map(), answer);
                    return answer;
                  });
            }
            finish(status);
          });
    });
  }
  if (!taken.ok()) finish(taken);
  return reactor;
}

grpc::ServerUnaryReactor* AdminService::ReloadMap(grpc::CallbackServerContext* context,
                                                  const grpc::ByteBuffer* request,
                                                  grpc::ByteBuffer* response) {
  return Run<v1::ReloadMapRequest, v1::ReloadMapResponse>(context, request, response, "ReloadMap",
                                                          actions_.reload);
}

grpc::ServerUnaryReactor* AdminService::LoadMap(grpc::CallbackServerContext* context,
                                                const grpc::ByteBuffer* request,
                                                grpc::ByteBuffer* response) {
  return Run<v1::LoadMapRequest, v1::LoadMapResponse>(context, request, response, "LoadMap",
                                                      actions_.load);
}

grpc::ServerUnaryReactor* AdminService::UnloadMap(grpc::CallbackServerContext* context,
                                                  const grpc::ByteBuffer* request,
                                                  grpc::ByteBuffer* response) {
  return Run<v1::UnloadMapRequest, v1::UnloadMapResponse>(context, request, response, "UnloadMap",
                                                          actions_.unload);
}

}  // namespace scanloc::server
