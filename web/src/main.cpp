// scanloc-web: a scanlocd for people, over HTTP.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "api.hpp"
#include "cli/connection_options.hpp"
#include "cli/declared_options.hpp"
#include "cli/output.hpp"
#include "gateway.hpp"
#include "http_server.hpp"
#include "page_files.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::web {
namespace {

/// gRPC's own, and whatever is open for a moment.
constexpr std::int64_t kOwnDescriptors = 48;
constexpr std::int64_t kLeastConnections = 16;

/// Raises the number of files that the process may have open as far as it may go, and tells how
/// many connections of guests it then has room for, beside those to the server: at most
/// options.max_connections. gRPC ends the process that has no descriptor left for it.
/// FailedPrecondition: too few for any use.
absl::StatusOr<int> ConnectionsThatFit(const HttpOptions& options) {
  rlimit limit = {};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return options.max_connections;
  rlimit raised = limit;
  raised.rlim_cur = raised.rlim_max;
  if (setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
  // Who watches or asks holds the connection to the server that he began with, though the gateway
  // may have let go of it.
  const std::int64_t reserved = kOwnDescriptors + static_cast<std::int64_t>(Gateway::kMaxClients) +
                                options.max_event_streams + options.num_workers;
  const auto open = static_cast<std::int64_t>(std::min<rlim_t>(limit.rlim_cur, 1U << 30));
  if (open < reserved + kLeastConnections) {
    return absl::FailedPreconditionError(absl::StrCat(
        "only ", open, " files and connections may be open at once, and ",
        reserved + kLeastConnections, " are needed: raise the limit (ulimit -n, LimitNOFILE)"));
  }
  return static_cast<int>(std::min<std::int64_t>(options.max_connections, open - reserved));
}

constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;

constexpr const char* kExamples = R"(Examples:
  scanloc-web --server 127.0.0.1:50061
  scanloc-web --server 127.0.0.1:50061 --listen 127.0.0.1:0
  curl --data-binary @scan.pcd http://127.0.0.1:8080/v1/localize?map=town
  scanloc-web --server 127.0.0.1:50061 --map town --snapshot town.html

Prints "scanloc-web ready on http://HOST:PORT" once it listens. The token of whoever asks, in
"Authorization: Bearer", is passed on to the server. SIGTERM and SIGINT end it.
Exit status: 0 stopped, or snapshot written; 1 failed; 2 wrong usage.)";

struct CommandLine {
  cli::Connection connection;
  HttpOptions http;
  bool allow_plaintext = false;
  std::string page_folder;
  std::string snapshot;
  std::string map;
};

void Declare(CLI::App& app, CommandLine& line) {
  cli::DeclareConnection(app, "Asking the server", &line.connection)->required();
  app.add_option("--listen", line.http.listen,
                 "HOST:PORT to serve HTTP on; port 0 takes a free one");
  app.add_option("--https-cert", line.http.tls_cert_file,
                 "Certificate of this service with its chain, PEM; then it serves HTTPS")
      ->type_name("FILE");
  app.add_option("--https-key", line.http.tls_key_file, "Its private key, PEM")->type_name("FILE");
  app.add_flag("--allow-plaintext", line.allow_plaintext,
               "Listen beyond this machine without HTTPS, behind a proxy that has it");
  app.add_option("--host", line.http.hosts,
                 "Name by which a proxy calls a service that listens on this machine only; may be "
                 "given several times")
      ->type_name("NAME");
  app.add_option("--max-connections", line.http.max_connections,
                 "Connections at once; one more is closed")
      ->check(CLI::Range(1, 100'000));
  app.add_option("--max-body-bytes", line.http.max_body_bytes, "Largest scan [bytes]")
      ->check(CLI::Range(1024, 512 << 20));
  app.add_option("--page", line.page_folder, "Folder of the page [the one that came with this]")
      ->type_name("DIR");
  auto* snapshot = app.add_option("--snapshot", line.snapshot,
                                  "Write the page with one map and its answers as a single file, "
                                  "and end")
                       ->type_name("FILE");
  app.add_option("--map", line.map, "The map of the snapshot")->type_name("NAME")->needs(snapshot);
  app.set_version_flag("--version", std::string("scanloc-web ") + SCANLOC_VERSION);
  app.footer(kExamples);
  cli::ShowDefaults(app);
  cli::RefuseEmptyValues(app);
}

int Fail(int exit_status, const absl::Status& status) {
  std::fprintf(stderr, "scanloc-web: %s\n", Printable(std::string(status.message())).c_str());
  return exit_status;
}

absl::Status CheckUsage(const CommandLine& line) {
  ASSIGN_OR_RETURN(const auto address, ParseAddress(line.http.listen));
  if (line.http.tls_cert_file.empty() && !line.allow_plaintext && !IsLoopback(address.first)) {
    return absl::InvalidArgumentError(
        absl::StrCat("listening on ", line.http.listen,
                     " without HTTPS would show tokens and answers to the network; give "
                     "--https-cert and --https-key, listen on 127.0.0.1, or --allow-plaintext"));
  }
  if (!line.snapshot.empty() && line.map.empty()) {
    return absl::InvalidArgumentError("--snapshot needs --map NAME");
  }
  return absl::OkStatus();
}

absl::Status WriteSnapshot(const CommandLine& line, const PageFiles& page, const Api& api) {
  ASSIGN_OR_RETURN(const auto text, page.Snapshot(api, line.map, ""));
  return cli::WriteText(line.snapshot, text);
}

sigset_t StopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  return signals;
}

int Run(CommandLine line) {
  if (auto status = CheckUsage(line); !status.ok()) return Fail(kExitUsage, status);
  auto to_server = cli::ClientOptionsOf(line.connection);
  if (!to_server.ok()) return Fail(kExitFailed, to_server.status());
  if (auto status = client::Validate(*to_server); !status.ok()) return Fail(kExitUsage, status);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);

  Gateway gateway(*std::move(to_server));
  const Api api(gateway);
  const auto page =
      PageFiles::Open(line.page_folder.empty() ? PageFiles::DefaultFolder() : line.page_folder);
  const bool needs_page = !line.page_folder.empty() || !line.snapshot.empty();
  if (!page.ok() && needs_page) return Fail(kExitFailed, page.status());
  const sigset_t stop = StopSignals();
  if (!line.snapshot.empty()) {
    pthread_sigmask(SIG_UNBLOCK, &stop, nullptr);
    const absl::Status status = WriteSnapshot(line, *page, api);
    return status.ok() ? 0 : Fail(kExitFailed, status);
  }
  if (!page.ok()) {
    std::fprintf(stderr, "scanloc-web: %s; serving /v1 alone\n",
                 Printable(std::string(page.status().message())).c_str());
  }
  const auto connections = ConnectionsThatFit(line.http);
  if (!connections.ok()) return Fail(kExitFailed, connections.status());
  if (*connections < line.http.max_connections) {
    std::fprintf(stderr,
                 "scanloc-web: serving at most %d connections: no more files may be open "
                 "(ulimit -n, LimitNOFILE)\n",
                 *connections);
    line.http.max_connections = *connections;
  }
  const auto server =
      HttpServer::Start(line.http, Api::TakesBody, [&](const Request& request) -> Response {
        if (page.ok()) {
          if (auto file = page->Serve(request)) return *std::move(file);
        }
        return api.Handle(request);
      });
  if (!server.ok()) return Fail(kExitFailed, server.status());
  std::printf("scanloc-web ready on %s\n", (*server)->url().c_str());
  std::fflush(stdout);
  int signal = 0;
  sigwait(&stop, &signal);
  return 0;
}

}  // namespace
}  // namespace scanloc::web

int main(int argc, char** argv) {
  const sigset_t stop = scanloc::web::StopSignals();
  pthread_sigmask(SIG_BLOCK, &stop, nullptr);  // before there are other threads
  try {
    CLI::App app("Serves what a scanlocd tells over HTTP, and a page to look at it.",
                 "scanloc-web");
    scanloc::web::CommandLine line;
    scanloc::web::Declare(app, line);
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      return app.exit(error) == 0 ? 0 : scanloc::web::kExitUsage;
    }
    return scanloc::web::Run(std::move(line));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "scanloc-web: %s\n", scanloc::Printable(error.what()).c_str());
    return scanloc::web::kExitFailed;
  }
}
