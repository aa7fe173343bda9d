#include "admission/admission.hpp"

#include <algorithm>
#include <cctype>
#include <random>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "ops/clock.hpp"
#include "rpc/unary_call.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::server {
namespace {

constexpr const char* kRequestIdKey = "x-request-id";
constexpr const char* kStreamMethod = "LocalizeStream";
constexpr std::size_t kMaxRequestIdBytes = 128;

std::string NewRequestId() {
  thread_local std::mt19937_64 random{std::random_device{}()};
  return absl::StrFormat("%016x", random());
}

std::string RequestIdOf(const grpc::CallbackServerContext& context) {
  const auto& metadata = context.client_metadata();
  const auto sent = metadata.find(kRequestIdKey);
  if (sent == metadata.end()) return NewRequestId();
  const std::string_view id(sent->second.data(), sent->second.size());
  const bool is_good =
      !id.empty() && id.size() <= kMaxRequestIdBytes &&
      std::ranges::all_of(id, [](unsigned char c) { return std::isgraph(c) != 0; });
  return is_good ? std::string(id) : NewRequestId();
}

/// By what the connection shows: the name in its certificate, or the address without the port.
std::string PeerOf(const grpc::CallbackServerContext& context) {
  if (const auto auth = context.auth_context(); auth != nullptr && auth->IsPeerAuthenticated()) {
    const auto names = auth->GetPeerIdentity();
    if (!names.empty()) return absl::StrCat("cert:", std::string(names[0].data(), names[0].size()));
  }
  return AddressOf(context);
}

}  // namespace

Call Admission::Begin(grpc::CallbackServerContext& context, const char* method, Role role) {
  Call call{.method = method, .request_id = RequestIdOf(context), .arrived_ns = NowNs()};
  call.is_stream = call.method == kStreamMethod;
  context.AddInitialMetadata(kRequestIdKey, call.request_id);
  auto caller = access_.Admit(context, role);
  call.admitted = caller.status();
  if (!caller.ok()) {
    call.client = PeerOf(context);
    metrics_.CountRejected("token");
    // A good token is not asked how many bad ones came from its address.
    if (auto status = failures_.Take(AddressOf(context)); !status.ok()) {
      call.admitted = status;
      call.is_quiet = true;
    }
    return call;
  }
  call.caller = *std::move(caller);
  call.client =
      call.caller.name.empty() ? PeerOf(context) : absl::StrCat("token:", call.caller.name);
  call.admitted = rates_.Take(call.client);
  if (!call.admitted.ok()) metrics_.CountRejected("rate");
  return call;
}

absl::Status Admission::AdmitNext(const Call& call) {
  RETURN_IF_ERROR(access_.AdmitAgain(call.caller, Role::kQuery));
  absl::Status status = rates_.Take(call.client);
  if (!status.ok()) metrics_.CountRejected("rate");
  return status;
}

void Admission::End(const Call& call, const absl::Status& status) {
  const double seconds = static_cast<double>(NowNs() - call.arrived_ns) / kNsPerSecond;
  const bool is_end_of_stream = call.is_stream && !status.ok();
  const bool is_answer = status.ok() && call.outcome.has_value();
  metrics_.CountCall(call.method, status.code(), is_answer ? call.map : "",
                     is_answer ? OutcomeName(*call.outcome) : "none",
                     is_end_of_stream ? std::nullopt : std::optional(seconds));
  if (log_ == RequestLog::kAll || (log_ == RequestLog::kFailed && !status.ok())) {
    Log(call, status, seconds);
  }
}

void Admission::Log(const Call& call, const absl::Status& status, double seconds) {
  if (call.is_quiet) return log_limit_.LeaveOut();
  const auto num_unlogged = log_limit_.MayLog(NowNs());
  if (!num_unlogged) return;
  LogFields fields{{"request_id", call.request_id},
                   {"method", call.method},
                   {"client", call.client},
                   {"code", absl::StatusCodeToString(status.code())},
                   {"duration_ms", 1e3 * seconds}};
  if (!call.map.empty()) fields.emplace_back("map", call.map);
  if (!call.content_id.empty()) fields.emplace_back("content_id", call.content_id);
  if (call.outcome) fields.emplace_back("outcome", OutcomeName(*call.outcome));
  if (!status.ok()) fields.emplace_back("reason", absl::StrCat(status.message()));
  if (*num_unlogged > 0) fields.emplace_back("requests_not_logged", *num_unlogged);
  const bool is_ours = status.code() == absl::StatusCode::kInternal ||
                       status.code() == absl::StatusCode::kUnknown ||
                       status.code() == absl::StatusCode::kDataLoss;
  LogWith(is_ours ? spdlog::level::err : spdlog::level::info, "request", fields);
}

}  // namespace scanloc::server
