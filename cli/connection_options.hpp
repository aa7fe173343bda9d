#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "absl/status/statusor.h"
#include "scanloc/client/client.hpp"

namespace scanloc::cli {

/// How to get through to a server.
struct Connection {
  std::string address;      ///< HOST:PORT
  std::string tls_ca_file;  ///< this and the next two as in client::ClientOptions
  std::string tls_cert_file;
  std::string tls_key_file;
  std::string token_file;   ///< its first word is the token; empty: none
  double deadline_s = 5.0;  ///< of connecting and of each call
};

/// Declares --server, which is returned, and how to get through to it.
CLI::Option* DeclareConnection(CLI::App& app, const char* group, Connection* connection);

/// NotFound: the token file cannot be read.
[[nodiscard]] absl::StatusOr<client::ClientOptions> ClientOptionsOf(const Connection& connection);

/// Errors as of ClientOptionsOf and client::Client::Connect.
[[nodiscard]] absl::StatusOr<client::Client> Connect(const Connection& connection);

}  // namespace scanloc::cli
