#include "scanloc/client/error_reason.hpp"

#include "scanloc/proto/status.hpp"

namespace scanloc::client {

std::string ReasonOf(const absl::Status& status) {
  const v1::ErrorReason reason = proto::ReasonOf(status);
  if (reason == v1::ERROR_REASON_UNSPECIFIED) return {};
  return v1::ErrorReason_Name(reason).substr(sizeof("ERROR_REASON_") - 1);
}

std::optional<double> RetryAfterOf(const absl::Status& status) { return proto::RetryAfter(status); }

}  // namespace scanloc::client
