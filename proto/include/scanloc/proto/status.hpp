#pragma once

#include <grpcpp/support/status.h>

#include <optional>

#include "absl/status/status.h"
#include "scanloc/v1/error_details.pb.h"

namespace scanloc::proto {

/// The status with a google.rpc.ErrorInfo of this reason.
[[nodiscard]] absl::Status WithReason(v1::ErrorReason reason, absl::Status status);

/// The reason of the status, UNSPECIFIED if it has none that this build knows.
[[nodiscard]] v1::ErrorReason ReasonOf(const absl::Status& status);

/// The status with a google.rpc.RetryInfo: the call may be made again after so long [s].
[[nodiscard]] absl::Status WithRetryAfter(absl::Status status, double delay_s);

/// The delay of the status' RetryInfo, at most an hour; none if it has none that can be read.
[[nodiscard]] std::optional<double> RetryAfter(const absl::Status& status);

/// The codes of both are the same numbers. The message is cut at 2048 bytes, well under what
/// transports carry in a header; longer ones would cost the client the code, too. ErrorInfo, which
/// is made up from the code where there is none, and RetryInfo go along as details
/// (google.rpc.Status).
[[nodiscard]] grpc::Status ToGrpc(const absl::Status& status);

/// As it goes into a message instead of a call's end.
[[nodiscard]] v1::ErrorStatus ToErrorStatus(const absl::Status& status);
[[nodiscard]] absl::Status FromErrorStatus(const v1::ErrorStatus& status);

/// A code that this build does not know becomes kUnknown. Details that cannot be read are dropped.
[[nodiscard]] absl::Status FromGrpc(const grpc::Status& status);

}  // namespace scanloc::proto
