#include "cli/connection_options.hpp"

#include <chrono>
#include <cstdint>
#include <sstream>

#include "cli/command.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::cli {

CLI::Option* DeclareConnection(CLI::App& app, const char* group, Connection* connection) {
  const OptionGroup in_group(app, group);
  auto* server =
      app.add_option("--server", connection->address, "scanlocd to ask")->type_name("HOST:PORT");
  app.add_option("--tls-ca", connection->tls_ca_file,
                 "The server must show a certificate of this CA, PEM [no encryption]")
      ->type_name("FILE")
      ->needs(server);
  auto* cert = app.add_option("--tls-cert", connection->tls_cert_file,
                              "Certificate to show, where the server asks for one, PEM")
                   ->type_name("FILE")
                   ->needs(server);
  app.add_option("--tls-key", connection->tls_key_file, "Its private key, PEM")
      ->type_name("FILE")
      ->needs(cert);
  app.add_option("--token-file", connection->token_file, "File with the token to show")
      ->type_name("FILE")
      ->needs(server);
  return server;
}

absl::StatusOr<client::ClientOptions> ClientOptionsOf(const Connection& connection) {
  const std::chrono::milliseconds deadline(
      static_cast<std::int64_t>(1000.0 * connection.deadline_s));
  client::ClientOptions options{.address = connection.address,
                                .tls_ca_file = connection.tls_ca_file,
                                .tls_cert_file = connection.tls_cert_file,
                                .tls_key_file = connection.tls_key_file,
                                .timeout = deadline,
                                .connect_timeout = deadline};
  if (!connection.token_file.empty()) {
    constexpr std::int64_t kMostBytes = 64 << 10;
    ASSIGN_OR_RETURN(const std::string text, ReadFile(connection.token_file, kMostBytes));
    if (!(std::istringstream(text) >> options.token)) {
      return absl::NotFoundError("there is no token in " + connection.token_file);
    }
  }
  return options;
}

absl::StatusOr<client::Client> Connect(const Connection& connection) {
  ASSIGN_OR_RETURN(const auto options, ClientOptionsOf(connection));
  return client::Client::Connect(options);
}

}  // namespace scanloc::cli
