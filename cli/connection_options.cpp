#include "cli/connection_options.hpp"

#include <fstream>

namespace scanloc::cli {

CLI::Option* DeclareConnection(CLI::App& app, const char* group, ServerQuery* query) {
  auto* server = app.add_option("--server", query->address, "scanlocd to ask")
                     ->type_name("HOST:PORT")
                     ->group(group);
  app.add_option("--tls-ca", query->tls_ca_file,
                 "The server must show a certificate of this CA, PEM [no encryption]")
      ->type_name("FILE")
      ->needs(server)
      ->group(group);
  auto* cert = app.add_option("--tls-cert", query->tls_cert_file,
                              "Certificate to show, where the server asks for one, PEM")
                   ->type_name("FILE")
                   ->needs(server)
                   ->group(group);
  app.add_option("--tls-key", query->tls_key_file, "Its private key, PEM")
      ->type_name("FILE")
      ->needs(cert)
      ->group(group);
  app.add_option("--token-file", query->token_file, "File with the token to show")
      ->type_name("FILE")
      ->needs(server)
      ->group(group);
  return server;
}

absl::StatusOr<client::Client> Connect(const ServerQuery& query) {
  client::ClientOptions options{.address = query.address,
                                .tls_ca_file = query.tls_ca_file,
                                .tls_cert_file = query.tls_cert_file,
                                .tls_key_file = query.tls_key_file,
                                .timeout = query.deadline,
                                .connect_timeout = query.deadline};
  if (!query.token_file.empty()) {
    std::ifstream file(query.token_file);
    if (!(file >> options.token)) {
      return absl::NotFoundError("cannot read a token from " + query.token_file);
    }
  }
  return client::Client::Connect(options);
}

}  // namespace scanloc::cli
