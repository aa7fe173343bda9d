#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>

#include "front/tls_files.hpp"

namespace scanloc::server {

/// What connections must show: nothing without files; else the server shows its certificate, and
/// asks for the clients' where there is a CA for them; beside it, `own_client_cert` is good. Each
/// new connection gets what is in force then. For one port of one server, which files and
/// credentials must outlive.
[[nodiscard]] std::shared_ptr<grpc::ServerCredentials> MakeCredentials(
    const TlsFiles* files, const std::string& own_client_cert);

}  // namespace scanloc::server
