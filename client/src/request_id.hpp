#pragma once

#include <grpcpp/client_context.h>

#include <string>

#include "absl/status/status.h"

namespace scanloc::client {

/// InvalidArgument: the server would not take it up. Empty is none, and OK.
[[nodiscard]] absl::Status CheckRequestId(const std::string& id);

/// Sends the id, if there is one, with the call.
void SendRequestId(const std::string& id, grpc::ClientContext& context);

}  // namespace scanloc::client
