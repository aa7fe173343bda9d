#pragma once

#include <grpcpp/server_builder.h>

namespace scanloc::server {

/// Bounds on what one connection may cost, whoever is behind it.
void LimitConnections(grpc::ServerBuilder& builder);

}  // namespace scanloc::server
