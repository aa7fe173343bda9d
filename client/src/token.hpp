#pragma once

#include <grpcpp/client_context.h>

#include "absl/status/status.h"
#include "scanloc/client/client.hpp"

namespace scanloc::client {

/// InvalidArgument if the token is none, or would be sent where others can read it.
[[nodiscard]] absl::Status CheckToken(const ClientOptions& options);

/// Sends the token, if there is one, with the call.
void ShowToken(const ClientOptions& options, grpc::ClientContext& context);

}  // namespace scanloc::client
