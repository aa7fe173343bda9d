#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/client_context.h>

#include <string>

#include "absl/status/status.h"
#include "scanloc/client/client.hpp"

/// What goes along with a request, and the texts within it.
namespace scanloc::client {

/// InvalidArgument if the token is none, or would be sent where others can read it.
[[nodiscard]] absl::Status CheckToken(const ClientOptions& options);

/// Sends the token, if there is one, with the call.
void ShowToken(const ClientOptions& options, grpc::ClientContext& context);

/// InvalidArgument: the server would not take it up. Empty is none, and OK.
[[nodiscard]] absl::Status CheckRequestId(const std::string& id);

/// Sends the id, if there is one, with the call.
void SendRequestId(const std::string& id, grpc::ClientContext& context);

/// Says which map a call is for, in `scanloc-map`, to a balancer that sends calls for one map to
/// one server; an empty name is not said.
void SendMapName(const std::string& map, grpc::ClientContext& context);

/// InvalidArgument: a text in the request is no UTF-8. Protobuf would print an error of its own,
/// send it all the same, and the server could not read it.
[[nodiscard]] absl::Status CheckTexts(const google::protobuf::Message& request);

}  // namespace scanloc::client
