#include "scanloc/proto/status.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

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

std::string DetailsOf(const absl::Status& status, const std::string& message) {
  v1::ErrorStatus details;
  status.ForEachPayload([&](absl::string_view type_url, const absl::Cord& payload) {
    auto* detail = details.add_details();
    detail->set_type_url(absl::StrCat(type_url));
    absl::CopyCordToString(payload, detail->mutable_value());
  });
  if (details.details().empty()) return {};
  details.set_code(status.raw_code());
  details.set_message(message);
  return details.SerializeAsString();
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
  const auto payload = status.GetPayload(kRetryInfoUrl);
  v1::RetryInfo info;
  if (!payload) return std::nullopt;
  std::string bytes;
  absl::CopyCordToString(*payload, &bytes);
  if (!info.ParseFromString(bytes)) return std::nullopt;
  const double delay_s = static_cast<double>(info.retry_delay().seconds()) +
                         info.retry_delay().nanos() / kNanosPerSecond;
  if (!(delay_s >= 0.0)) return std::nullopt;
  return std::min(delay_s, kMaxRetry_s);
}

grpc::Status ToGrpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  std::string message(status.message());
  if (message.size() > kMaxMessageBytes) {
    message.resize(kMaxMessageBytes);
    absl::StrAppend(&message, "...");
  }
  return {static_cast<grpc::StatusCode>(status.raw_code()), message, DetailsOf(status, message)};
}

absl::Status FromGrpc(const grpc::Status& status) {
  // absl::Status itself reads a code that is none of its own as kUnknown.
  absl::Status result(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
  const std::string& bytes = status.error_details();
  v1::ErrorStatus details;
  if (result.ok() || bytes.size() > kMaxDetailsBytes || !details.ParseFromString(bytes)) {
    return result;
  }
  for (const auto& detail : details.details()) {
    if (detail.type_url() == kRetryInfoUrl) {
      result.SetPayload(kRetryInfoUrl, absl::Cord(detail.value()));
    }
  }
  return result;
}

}  // namespace scanloc::proto
