#pragma once

namespace scanloc::server {

/// Sends what gRPC and protobuf would print on stderr to our log at level debug: most of it is what
/// clients do wrong, and any client could fill the log with it. Why a TLS handshake failed is a
/// warning, ten a minute: it is how a wrong certificate is told from a wrong address. Call before
/// any other thread exists.
void RouteLibraryLogs();

}  // namespace scanloc::server
