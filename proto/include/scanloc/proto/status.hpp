#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace scanloc::proto {

/// The codes of both are the same numbers. The message is cut at 2048 bytes, well under what
/// transports carry in a header; longer ones would cost the client the code, too.
[[nodiscard]] grpc::Status ToGrpc(const absl::Status& status);

/// A code that this build does not know becomes kUnknown.
[[nodiscard]] absl::Status FromGrpc(const grpc::Status& status);

}  // namespace scanloc::proto
