#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "absl/status/statusor.h"
#include "scanloc/server/server_options.hpp"

namespace scanloc::server {

/// What connections must show: nothing without TLS; else the server shows its certificate, and asks
/// for the clients' where there is a CA for them. Renewed files are taken up within seconds, for
/// connections made then.
///
/// InvalidArgument that names the file: it cannot be read, or is no PEM text.
[[nodiscard]] absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> MakeCredentials(
    const TlsOptions& options);

}  // namespace scanloc::server
