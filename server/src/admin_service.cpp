#include "admin_service.hpp"

#include <spdlog/spdlog.h>

#include <string>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
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

AdminService::AdminService(const MapRegistry& maps, Access& access, AdminActions actions)
    : maps_(maps), access_(access), actions_(std::move(actions)), worker_(1, kMaxWaiting) {}

template <typename Request, typename Response>
grpc::ServerUnaryReactor* AdminService::Run(grpc::CallbackServerContext* context,
                                            const grpc::ByteBuffer* request,
                                            grpc::ByteBuffer* response, const char* what,
                                            const Action& action) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const auto caller = access_.Admit(*context, Role::kAdmin);
  absl::Status taken = caller.status();
  if (taken.ok()) taken = CheckRequest(*request);
  if (taken.ok()) {
    taken = Guard([&] {
      return worker_.Submit([=, &maps = maps_, &action, who = caller->name](int) {
        absl::Status status = CheckStillWanted(*context);
        if (status.ok()) {
          status = Respond<Request>(
              *request, response, [&](const Request& message) -> absl::StatusOr<Response> {
                if (auto name = proto::CheckMapName(message.map()); !name.ok()) return name;
                const absl::Status done = action(message.map());
                spdlog::info("{} of map \"{}\" by {}: {}", what,
                             absl::Utf8SafeCHexEscape(message.map()), who, done.ToString());
                if (!done.ok()) return done;
                Response answer;
                Describe(maps, message.map(), answer);
                return answer;
              });
        }
        reactor->Finish(proto::ToGrpc(status));
      });
    });
  }
  if (!taken.ok()) reactor->Finish(proto::ToGrpc(taken));
  return reactor;
}

grpc::ServerUnaryReactor* AdminService::ReloadMap(grpc::CallbackServerContext* context,
                                                  const grpc::ByteBuffer* request,
                                                  grpc::ByteBuffer* response) {
  return Run<v1::ReloadMapRequest, v1::ReloadMapResponse>(context, request, response, "reload",
                                                          actions_.reload);
}

grpc::ServerUnaryReactor* AdminService::LoadMap(grpc::CallbackServerContext* context,
                                                const grpc::ByteBuffer* request,
                                                grpc::ByteBuffer* response) {
  return Run<v1::LoadMapRequest, v1::LoadMapResponse>(context, request, response, "load",
                                                      actions_.load);
}

grpc::ServerUnaryReactor* AdminService::UnloadMap(grpc::CallbackServerContext* context,
                                                  const grpc::ByteBuffer* request,
                                                  grpc::ByteBuffer* response) {
  return Run<v1::UnloadMapRequest, v1::UnloadMapResponse>(context, request, response, "unload",
                                                          actions_.unload);
}

}  // namespace scanloc::server
