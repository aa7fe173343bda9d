#include "client_state.hpp"

#include <random>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::client {

using std::chrono::milliseconds;

gpr_timespec ToGpr(Clock::time_point time) {
  const auto left =
      std::chrono::duration_cast<std::chrono::nanoseconds>(time - Clock::now()).count();
  return gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC), gpr_time_from_nanos(left, GPR_TIMESPAN));
}

double DrawShare() {
  thread_local std::mt19937_64 random{std::random_device{}()};
  return static_cast<double>(random() >> 11) / static_cast<double>(1ULL << 53);
}

bool IsReset(const absl::Status& status) {
  // HTTP/2's ENHANCE_YOUR_CALM; nothing but the text tells it from a refusal of the server's.
  return absl::IsResourceExhausted(status) &&
         absl::StrContains(status.message(), "RST_STREAM with error code 11");
}

absl::Status Client::State::WithAddress(const absl::Status& status) const {
  if (status.ok()) return status;
  absl::Status told(status.code(),
                    absl::StrCat("scanlocd at ", options.address, ": ", status.message()));
  status.ForEachPayload([&](absl::string_view type_url, const absl::Cord& payload) {
    told.SetPayload(type_url, payload);
  });
  return told;
}

absl::Status Client::State::BadReply(const absl::Status& status) const {
  return WithAddress(absl::InternalError(
      absl::StrCat("its answer makes no sense, is it of another version? ", status.message())));
}

absl::StatusOr<Terms> Client::State::TermsOf(const std::optional<milliseconds>& timeout,
                                             const std::string& request_id) const {
  if (timeout) {
    RETURN_IF_ERROR(CheckTimeout("timeout", *timeout, milliseconds(1)));
  }
  RETURN_IF_ERROR(CheckRequestId(request_id));
  return Terms{.deadline = Clock::now() + timeout.value_or(options.timeout),
               .request_id = request_id};
}

absl::StatusOr<MapInfo> Client::State::FetchInfo(const std::string& map, const Terms& terms) const {
  v1::GetMapInfoRequest request;
  request.set_map(map);
  ASSIGN_OR_RETURN(const auto response, Call(&v1::Localization::Stub::GetMapInfo, request, terms));
  return Read(response.info());
}

absl::StatusOr<std::shared_ptr<CachedMap>> Client::State::FetchMap(const std::string& map,
                                                                   const Terms& terms) {
  ASSIGN_OR_RETURN(const auto info, FetchInfo(map, terms));
  return cache.Put(map, info);
}

absl::StatusOr<LocalizeReply> Client::State::Localize(v1::LocalizeRequest request,
                                                      const RequestOptions& request_options,
                                                      const Terms& terms) const {
  request.set_map(request_options.map);
  proto::SetHeader(request_options.header, &request);
  *request.mutable_options() = proto::ToProto(request_options.query, request_options.budget);
  ASSIGN_OR_RETURN(const auto response, Call(&v1::Localization::Stub::Localize, request, terms));
  return Read(response);
}

absl::StatusOr<LocalizeReply> Client::State::LocalizeWith(CachedMap& map, PointView scan,
                                                          const RequestOptions& request_options,
                                                          const Terms& terms) const {
  ASSIGN_OR_RETURN(const auto descriptor, map.Describe(scan, request_options.mount));
  v1::LocalizeRequest request;
  *request.mutable_descriptors() = proto::ToProto(descriptor);
  auto reply = Localize(std::move(request), request_options, terms);
  if (reply.ok()) TellOfBase(request_options.mount, reply->answer);
  return reply;
}

}  // namespace scanloc::client
