#include "absl/strings/str_cat.h"
#include "call_metadata.hpp"
#include "client_state.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::client {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kMaxTimeout = std::chrono::hours(1);

absl::Status CheckRetry(const RetryOptions& retry) {
  constexpr int kMaxAttempts = 100;
  if (retry.max_attempts >= 1 && retry.max_attempts <= kMaxAttempts) {
    absl::Status status = CheckTimeout("initial_backoff", retry.initial_backoff, milliseconds(1));
    status.Update(CheckTimeout("max_backoff", retry.max_backoff, retry.initial_backoff));
    return status;
  }
  return absl::InvalidArgumentError(absl::StrCat("max_attempts is ", retry.max_attempts,
                                                 "; it must lie in [1, ", kMaxAttempts, "]"));
}

}  // namespace

absl::Status CheckTimeout(const char* field, milliseconds timeout, milliseconds low) {
  if (timeout >= low && timeout <= kMaxTimeout) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(field, " is ", timeout.count(),
                                                 " ms; it must lie in [", low.count(), ", ",
                                                 kMaxTimeout.count(), "] ms"));
}

absl::Status CheckScanSize(PointView scan) {
  if (scan.size() <= limits::kMaxPointsPerScan) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("the scan has ", scan.size(), " points; at most ",
                                                 limits::kMaxPointsPerScan, " make a scan"));
}

absl::Status Validate(const ClientOptions& options) {
  if (options.address.empty()) {
    return absl::InvalidArgumentError("address is empty; it must be HOST:PORT");
  }
  if (options.tls_cert_file.empty() != options.tls_key_file.empty() ||
      (options.tls_ca_file.empty() && !options.tls_cert_file.empty())) {
    return absl::InvalidArgumentError(
        "a certificate needs its private key and the CA of the server; give all three");
  }
  if (options.tls_ca_file.empty() && !options.tls_server_name.empty()) {
    return absl::InvalidArgumentError(
        "a server's name is checked only where there is a CA for its certificate; give both");
  }
  RETURN_IF_ERROR(CheckToken(options));
  absl::Status status = CheckTimeout("timeout", options.timeout, milliseconds(1));
  status.Update(CheckTimeout("connect_timeout", options.connect_timeout, milliseconds(0)));
  status.Update(CheckRetry(options.retry));
  return status;
}

}  // namespace scanloc::client
