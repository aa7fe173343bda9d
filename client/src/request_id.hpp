#pragma once

#include <grpcpp/client_context.h>

#include <string>

#include "absl/status/status.h"

namespace scanloc::client {

/// InvalidArgument: the server would not take it up. Empty is none, and OK.
[[nodiscard]] absl::Status CheckRequestId(const std::string& id);

/// Sends the id, if there is one, with the call.
void SendRequestId(const std::string& id, grpc::ClientContext& context);

/// Says which map a call is for, in `scanloc-map`, to a balancer that sends calls for one map to
/// one server; an empty name is not said.
void SendMapName(const std::string& map, grpc::ClientContext& context);

}  // namespace scanloc::client
