#include "scanloc/proto/status.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "scanloc/v1/error_details.pb.h"

namespace scanloc::proto {
namespace {

constexpr std::size_t kMaxMessageBytes = 2048;
constexpr std::size_t kMaxDetailsBytes = 4096;
constexpr const char* kRetryInfoUrl = "type.googleapis.com/google.rpc.RetryInfo";
constexpr double kNanosPerSecond = 1e9;
constexpr double kMaxRetry_s = 3600.0;

constexpr const char* kErrorInfoUrl = "type.googleapis.com/google.rpc.ErrorInfo";
constexpr const char* kDomain = "scanloc";
constexpr absl::string_view kReasonPrefix = "ERROR_REASON_";

// Where nobody said it: what the code means nearly everywhere.
constexpr std::pair<absl::StatusCode, v1::ErrorReason> kUsualReasons[] = {
    {absl::StatusCode::kInvalidArgument, v1::ERROR_REASON_INVALID_REQUEST},
    {absl::StatusCode::kNotFound, v1::ERROR_REASON_MAP_NOT_FOUND},
    {absl::StatusCode::kUnavailable, v1::ERROR_REASON_NOT_READY},
    {absl::StatusCode::kFailedPrecondition, v1::ERROR_REASON_METHOD_NOT_SERVED},
    {absl::StatusCode::kAborted, v1::ERROR_REASON_MAP_REPLACED},
    {absl::StatusCode::kResourceExhausted, v1::ERROR_REASON_BUSY},
    {absl::StatusCode::kUnauthenticated, v1::ERROR_REASON_TOKEN_MISSING_OR_UNKNOWN},
    {absl::StatusCode::kPermissionDenied, v1::ERROR_REASON_ROLE_NOT_ALLOWED},
    {absl::StatusCode::kDeadlineExceeded, v1::ERROR_REASON_TOO_LATE},
    {absl::StatusCode::kCancelled, v1::ERROR_REASON_CANCELLED},
    {absl::StatusCode::kAlreadyExists, v1::ERROR_REASON_MAP_IN_SERVICE},
    {absl::StatusCode::kUnimplemented, v1::ERROR_REASON_NO_SUCH_METHOD}};
v1::ErrorReason UsualReasonOf(absl::StatusCode code) {
  for (const auto& [usual_code, reason] : kUsualReasons) {
    if (usual_code == code) return reason;
  }
  return v1::ERROR_REASON_INTERNAL;
}

template <typename Message>
std::optional<Message> DetailOf(const absl::Status& status, const char* type_url) {
  const auto payload = status.GetPayload(type_url);
  Message message;
  if (!payload || !message.ParseFromString(std::string(*payload))) return std::nullopt;
  return message;
}

bool IsKnown(const std::string& type_url) {
  return type_url == kErrorInfoUrl || type_url == kRetryInfoUrl;
}

}  // namespace

absl::Status WithRetryAfter(absl::Status status, double delay_s) {
  v1::RetryInfo info;
  const double whole_s = std::floor(delay_s);
  info.mutable_retry_delay()->set_seconds(static_cast<std::int64_t>(whole_s));
  info.mutable_retry_delay()->set_nanos(
      static_cast<std::int32_t>((delay_s - whole_s) * kNanosPerSecond));
  status.SetPayload(kRetryInfoUrl, absl::Cord(info.SerializeAsString()));
  return status;
}

std::optional<double> RetryAfter(const absl::Status& status) {
  const auto info = DetailOf<v1::RetryInfo>(status, kRetryInfoUrl);
  if (!info) return std::nullopt;
  const double delay_s = static_cast<double>(info->retry_delay().seconds()) +
                         info->retry_delay().nanos() / kNanosPerSecond;
  if (!(delay_s >= 0.0)) return std::nullopt;
  return std::min(delay_s, kMaxRetry_s);
}

absl::Status WithReason(v1::ErrorReason reason, absl::Status status) {
  v1::ErrorInfo info;
  info.set_reason(v1::ErrorReason_Name(reason).substr(kReasonPrefix.size()));
  info.set_domain(kDomain);
  status.SetPayload(kErrorInfoUrl, absl::Cord(info.SerializeAsString()));
  return status;
}

v1::ErrorReason ReasonOf(const absl::Status& status) {
  const auto info = DetailOf<v1::ErrorInfo>(status, kErrorInfoUrl);
  v1::ErrorReason reason = v1::ERROR_REASON_UNSPECIFIED;
  if (info && info->domain() == kDomain) {
    (void)v1::ErrorReason_Parse(absl::StrCat(kReasonPrefix, info->reason()), &reason);
  }
  return reason;
}

v1::ErrorStatus ToErrorStatus(const absl::Status& status) {
  v1::ErrorStatus message;
  message.set_code(status.raw_code());
  std::string text(status.message());
  if (text.size() > kMaxMessageBytes) {
    text.resize(kMaxMessageBytes);
    absl::StrAppend(&text, "...");
  }
  message.set_message(text);
  const absl::Status told =
      status.GetPayload(kErrorInfoUrl) ? status : WithReason(UsualReasonOf(status.code()), status);
  for (const char* type_url : {kErrorInfoUrl, kRetryInfoUrl}) {
    const auto payload = told.GetPayload(type_url);
    if (!payload) continue;
    auto* detail = message.add_details();
    detail->set_type_url(type_url);
    absl::CopyCordToString(*payload, detail->mutable_value());
  }
  return message;
}

absl::Status FromErrorStatus(const v1::ErrorStatus& message) {
  // absl::Status itself reads a code that is none of its own as kUnknown.
  absl::Status status(static_cast<absl::StatusCode>(message.code()), message.message());
  if (status.ok()) return absl::UnknownError("an error of code 0");
  for (const auto& detail : message.details()) {
    if (IsKnown(detail.type_url())) {
      status.SetPayload(detail.type_url(), absl::Cord(detail.value()));
    }
  }
  return status;
}

grpc::Status ToGrpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const v1::ErrorStatus message = ToErrorStatus(status);
  return {static_cast<grpc::StatusCode>(status.raw_code()), message.message(),
          message.SerializeAsString()};
}

absl::Status FromGrpc(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  v1::ErrorStatus message;
  const std::string& bytes = status.error_details();
  if (bytes.size() > kMaxDetailsBytes || !message.ParseFromString(bytes)) message.Clear();
  // What the call itself says counts, whatever the details repeat.
  message.set_code(static_cast<int>(status.error_code()));
  message.set_message(status.error_message());
  return FromErrorStatus(message);
}

}  // namespace scanloc::proto
