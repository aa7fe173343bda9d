#pragma once

#include <grpc/support/time.h>
#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "absl/status/statusor.h"
#include "backoff.hpp"
#include "call_metadata.hpp"
#include "map_cache.hpp"
#include "scanloc/client/client.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/convert_viewer.hpp"
#include "scanloc/proto/status.hpp"
#include "scanloc/v1/admin.grpc.pb.h"
#include "scanloc/v1/localization.grpc.pb.h"
#include "scanloc/v1/viewer.grpc.pb.h"

namespace scanloc::client {

/// Not the time of day: that may be set while a call runs.
using Clock = std::chrono::steady_clock;

/// The same moment, as gRPC counts it.
[[nodiscard]] gpr_timespec ToGpr(Clock::time_point time);

/// InvalidArgument, naming the field, if the time is less than low or more than an hour.
[[nodiscard]] absl::Status CheckTimeout(const char* field, std::chrono::milliseconds timeout,
                                        std::chrono::milliseconds low);

/// InvalidArgument if no message may hold so many points.
[[nodiscard]] absl::Status CheckScanSize(PointView scan);

/// What one call is bound to, however often it is tried.
struct Terms {
  Clock::time_point deadline;
  std::string request_id;
};

/// Uniform in [0, 1).
[[nodiscard]] double DrawShare();

/// Whether gRPC itself, in a server short of memory, has ended the call before anybody there saw
/// it.
[[nodiscard]] bool IsReset(const absl::Status& status);

/// What a client and its streams share. Thread-safe.
struct Client::State {
  State(const ClientOptions& client_options, std::shared_ptr<grpc::Channel> to_server)
      : options(client_options),
        channel(std::move(to_server)),
        stub(v1::Localization::NewStub(channel)),
        admin(v1::Admin::NewStub(channel)),
        viewer(v1::Viewer::NewStub(channel)) {}

  [[nodiscard]] absl::Status WithAddress(const absl::Status& status) const;

  /// The server's answer is at fault, not the caller's argument.
  [[nodiscard]] absl::Status BadReply(const absl::Status& status) const;

  /// Of a call that begins now. InvalidArgument: it may not have these.
  [[nodiscard]] absl::StatusOr<Terms> TermsOf(
      const std::optional<std::chrono::milliseconds>& timeout,
      const std::string& request_id = "") const;
  [[nodiscard]] Terms UsualTerms() const {
    return {.deadline = Clock::now() + options.timeout, .request_id = {}};
  }

  template <typename Stub, typename Request, typename Response>
  using Method = grpc::Status (Stub::*)(grpc::ClientContext*, const Request&, Response*);

  template <typename Request, typename Response>
  [[nodiscard]] absl::StatusOr<Response> Call(
      Method<v1::Localization::Stub, Request, Response> method, const Request& request,
      const Terms& terms) const {
    return CallAgain(*stub, method, request, terms);
  }

  /// As often as it takes and the terms allow.
  template <typename Stub, typename Request, typename Response>
  [[nodiscard]] absl::StatusOr<Response> CallAgain(Stub& service,
                                                   Method<Stub, Request, Response> method,
                                                   const Request& request,
                                                   const Terms& terms) const {
    Backoff backoff(options.retry, DrawShare);
    while (true) {
      auto response = CallOn(service, method, request, terms);
      if (response.ok()) return response;
      const auto wait = backoff.After(response.status());
      const Clock::time_point again = Clock::now() + wait.value_or(std::chrono::milliseconds(0));
      if (!wait || again >= terms.deadline) return response;
      std::this_thread::sleep_until(again);
    }
  }

  template <typename Stub, typename Request, typename Response>
  [[nodiscard]] absl::StatusOr<Response> CallOn(Stub& service,
                                                Method<Stub, Request, Response> method,
                                                const Request& request, const Terms& terms) const {
    RETURN_IF_ERROR(CheckTexts(request));
    grpc::ClientContext context;
    context.set_deadline(ToGpr(terms.deadline));
    ShowToken(options, context);
    SendRequestId(terms.request_id, context);
    if constexpr (requires { request.map(); }) SendMapName(request.map(), context);
    Response response;
    const absl::Status status = proto::FromGrpc((service.*method)(&context, request, &response));
    // Nobody here cancels: it is how gRPC ends calls that meet a server in its last moment.
    if (absl::IsCancelled(status)) {
      return WithAddress(absl::UnavailableError("it stopped before it could answer"));
    }
    if (IsReset(status)) return WithAddress(absl::UnavailableError("it is short of memory"));
    if (!status.ok()) return WithAddress(status);
    return response;
  }

  /// What FromProto makes of the response; a bad reply if nothing.
  template <typename Response>
  [[nodiscard]] auto Read(const Response& response) const -> decltype(proto::FromProto(response)) {
    auto read = proto::FromProto(response);
    if (!read.ok()) return BadReply(read.status());
    return read;
  }

  template <typename Request, typename Response>
  [[nodiscard]] auto View(Method<v1::Viewer::Stub, Request, Response> method,
                          const Request& request) const
      -> decltype(proto::FromProto(std::declval<Response>())) {
    ASSIGN_OR_RETURN(const auto response, CallAgain(*viewer, method, request, UsualTerms()));
    return Read(response);
  }

  /// Reload or load.
  template <typename Request, typename Response>
  [[nodiscard]] absl::StatusOr<MapSummary> Change(
      Method<v1::Admin::Stub, Request, Response> method, const std::string& map,
      const std::optional<std::chrono::milliseconds>& timeout) const {
    ASSIGN_OR_RETURN(const auto terms, TermsOf(timeout));
    Request request;
    request.set_map(map);
    ASSIGN_OR_RETURN(const auto response, CallOn(*admin, method, request, terms));
    v1::ListMapsResponse list;
    *list.add_maps() = response.map();
    ASSIGN_OR_RETURN(auto maps, Read(list));
    return std::move(maps.front());
  }

  [[nodiscard]] absl::StatusOr<MapInfo> FetchInfo(const std::string& map, const Terms& terms) const;
  /// Into the cache.
  [[nodiscard]] absl::StatusOr<std::shared_ptr<CachedMap>> FetchMap(const std::string& map,
                                                                    const Terms& terms);

  [[nodiscard]] absl::StatusOr<LocalizeReply> Localize(v1::LocalizeRequest request,
                                                       const RequestOptions& request_options,
                                                       const Terms& terms) const;

  [[nodiscard]] absl::StatusOr<LocalizeReply> LocalizeWith(CachedMap& map, PointView scan,
                                                           const RequestOptions& request_options,
                                                           const Terms& terms) const;

  const ClientOptions options;
  const std::shared_ptr<grpc::Channel> channel;
  const std::unique_ptr<v1::Localization::Stub> stub;
  const std::unique_ptr<v1::Admin::Stub> admin;
  const std::unique_ptr<v1::Viewer::Stub> viewer;
  MapCache cache;
};

}  // namespace scanloc::client
