#pragma once

#include <grpcpp/server_builder.h>

#include <cstdint>

namespace scanloc::server {

/// Bounds on what one connection may cost, whoever is behind it, and on the memory [bytes] that all
/// of them may have gRPC hold. Compressed messages are refused: a small one may unpack to a large
/// one.
void LimitConnections(grpc::ServerBuilder& builder, std::int64_t max_memory_bytes);

}  // namespace scanloc::server
