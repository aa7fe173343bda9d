#pragma once

#include <grpcpp/support/status.h>

#include <optional>

#include "absl/status/status.h"

namespace scanloc::proto {

/// The status with a google.rpc.RetryInfo: the call may be made again after so long [s].
[[nodiscard]] absl::Status WithRetryAfter(absl::Status status, double delay_s);

/// The delay of the status' RetryInfo, at most an hour; none if it has none that can be read.
[[nodiscard]] std::optional<double> RetryAfter(const absl::Status& status);

/// The codes of both are the same numbers. The message is cut at 2048 bytes, well under what
/// transports carry in a header; longer ones would cost the client the code, too. A RetryInfo goes
/// along as details (google.rpc.Status).
[[nodiscard]] grpc::Status ToGrpc(const absl::Status& status);

/// A code that this build does not know becomes kUnknown. Details that cannot be read are dropped.
[[nodiscard]] absl::Status FromGrpc(const grpc::Status& status);

}  // namespace scanloc::proto
