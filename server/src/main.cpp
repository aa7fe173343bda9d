#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <csignal>
#include <exception>
#include <iostream>
#include <istream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "absl/synchronization/mutex.h"
#include "cli/declared_options.hpp"
#include "front/listener.hpp"
#include "front/memory.hpp"
#include "lifecycle.hpp"
#include "ops/health_probe.hpp"
#include "ops/logs.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/files/files.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/server/build_info.hpp"
#include "scanloc/server/server.hpp"
#include "scanloc/server/server_options.hpp"

namespace scanloc::server {
namespace {

/// Of the first line that begins so, behind blanks and quotes; 0 if none does.
std::size_t LineOf(const std::vector<std::string>& lines, const std::string& begin) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::size_t start = lines[i].find_first_not_of(" \t\"'");
    if (start != std::string::npos && absl::StartsWith(lines[i].substr(start), begin)) return i + 1;
  }
  return 0;
}

/// Reads a TOML file of options as CLI11 does, and knows in which line of it an option stands.
class ConfigFile : public CLI::ConfigTOML {
 public:
  /// Of what it reads later, flags of this program take true and false alone: CLI11 takes a date
  /// for the number that it begins with, and that for true. The program must outlive it.
  void KnowFlagsOf(const CLI::App& app) { app_ = &app; }

  [[nodiscard]] std::vector<CLI::ConfigItem> from_config(std::istream& input) const override {
    constexpr std::size_t kMostBytes = 1 << 20;  // /dev/zero has no end
    std::string text(kMostBytes, '\0');
    input.read(text.data(), kMostBytes);
    text.resize(static_cast<std::size_t>(input.gcount()));
    if (!input.eof()) {
      throw CLI::ValidationError(
          "--config", absl::StrCat("cannot be read, or has ", kMostBytes, " bytes or more"));
    }
    lines_ = absl::StrSplit(text, '\n');
    std::istringstream stream(text);
    std::vector<CLI::ConfigItem> found = CLI::ConfigTOML::from_config(stream);
    for (const CLI::ConfigItem& item : found) names_.push_back(item.fullname());
    for (const CLI::ConfigItem& item : found) Check(item);
    return found;
  }

  /// What is wrong with the file, with its line, if the error is about an option that it gives and
  /// the command line does not.
  [[nodiscard]] std::optional<std::string> Explain(
      const CLI::ParseError& error, const std::string& path,
      const std::vector<std::string>& arguments) const {
    const std::string what = error.what();
    for (const std::string& name : names_) {
      const std::string flag = absl::StrCat("--", name);
      const bool is_unknown = dynamic_cast<const CLI::ConfigError*>(&error) != nullptr &&
                              absl::EndsWith(what, absl::StrCat(" ", name));
      const bool is_on_command_line =
          std::ranges::any_of(arguments, [&](const std::string& argument) {
            return argument == flag || absl::StartsWith(argument, absl::StrCat(flag, "="));
          });
      const bool is_bad = !is_on_command_line && absl::StrContains(what, flag);
      if (!is_unknown && !is_bad) continue;
      absl::string_view begin = name;
      const bool is_section = absl::ConsumeSuffix(&begin, ".++");  // as CLI11 calls its opening
      const std::size_t line = LineOf(
          lines_, is_section ? absl::StrCat("[", begin)
                             : std::string(begin.substr(begin.rfind('.') + 1)));  // npos + 1 is 0
      const std::string where = absl::StrCat(path, ":", line, ": ");
      if (is_section) return absl::StrCat(where, "there are no sections; leave out [", begin, "]");
      if (is_unknown) return absl::StrCat(where, "no option is named \"", name, "\"; see --help");
      return absl::StrCat(where, what);
    }
    return std::nullopt;
  }

 private:
  void Check(const CLI::ConfigItem& item) const {
    const std::string name = absl::StrCat("--", item.fullname());
    // A flag would be taken for set by it.
    if (std::ranges::count(item.inputs, "") > 0) {
      throw CLI::ValidationError(name, "its value is empty; give one, or leave the option out");
    }
    const CLI::Option* option = app_ == nullptr ? nullptr : app_->get_option_no_throw(name);
    if (option == nullptr || option->get_expected_min() > 0) return;
    const std::string value = absl::StrJoin(item.inputs, ",");
    if (value == "true" || value == "false") return;
    throw CLI::ValidationError(
        name, absl::StrCat("its value is \"", Printable(value), "\"; it must be true or false"));
  }

  const CLI::App* app_ = nullptr;
  mutable std::vector<std::string> lines_;
  mutable std::vector<std::string> names_;  // of the options that it gives
};

constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;

constexpr const char* kExamples = R"(Examples:
  scanlocd --map town=/srv/maps/town.scanloc
  scanlocd --map north=north.scanloc --map south=south.scanloc --listen 127.0.0.1:0

Prints "scanlocd ready on HOST:PORT" once every map answers. Health (grpc.health.v1) knows the
server as "" and each map as scanloc.map/NAME. SIGTERM and SIGINT end it after what is in flight.
Exit status: 0 stopped, 1 failed, 2 wrong usage.)";

struct CommandLine {
  ServerOptions options;
  std::vector<std::string> maps;
  std::string log_level = "info";
  LogFormat log_format = LogFormat::kText;
  std::optional<std::int64_t> cache_bytes;
  Probe probe;
  std::shared_ptr<ConfigFile> config = std::make_shared<ConfigFile>();
};

/// CLI11's own check of names shows the numbers behind them, which are no text.
template <typename Choice>
CLI::Option* Choose(CLI::Option* option, const CLI::TransformPairs<Choice>& choices) {
  std::vector<std::string> names;
  for (const auto& [name, choice] : choices) names.push_back(name);
  option->transform(CLI::Transformer(choices).description(""));
  return option->transform(CLI::IsMember(names))->type_name("TEXT");  // looks first
}

void Declare(CLI::App& app, CommandLine& line) {
  ServerOptions& options = line.options;
  app.add_option("--map", line.maps, "a map to serve, as NAME=FILE; once for every map")
      ->take_all()
      ->expected(1);
  app.add_option("--maps-dir", options.maps_dir, "serve every file NAME.scanloc of a folder, too")
      ->type_name("DIR");
  app.add_flag("--admin", options.admin,
               "let tokens of the role admin load, reload and unload maps");
  app.add_option("--listen", options.listen, "HOST:PORT to listen on; port 0 takes a free one");
  app.add_option("--tls-cert", options.tls.cert_file,
                 "certificate of the server with its chain, PEM; taken up anew when renewed")
      ->type_name("FILE");
  app.add_option("--tls-key", options.tls.key_file, "its private key, PEM")->type_name("FILE");
  app.add_option("--tls-client-ca", options.tls.client_ca_file,
                 "clients must show a certificate of this CA, PEM")
      ->type_name("FILE");
  app.add_flag("--allow-plaintext", options.allow_plaintext,
               "listen beyond this machine without TLS, behind a proxy that has it");
  app.add_option("--token-file", options.token_file,
                 "who may call: lines NAME ROLE TOKEN; read again on change")
      ->type_name("FILE");
  app.add_option("--threads", options.num_threads, "threads that answer queries; 0: one a core");
  app.add_option("--max-inflight", options.max_inflight,
                 "queries that run or wait; one more is refused at once");
  app.add_option("--max-wait-seconds", options.max_wait_s,
                 "longest that a query may have to wait for a thread; one more is refused at once");
  app.add_option("--max-streams", options.max_streams,
                 "robots on a stream at once; one more is refused at once");
  app.add_option("--max-message-bytes", options.max_message_bytes, "largest request [bytes]");
  app.add_option("--drain-seconds", options.drain_s,
                 "how long queries in flight may take to end when stopping [s]");
  app.add_option("--max-streams-per-client", options.max_streams_per_client,
                 "of these, for one client (raise it behind a proxy without tokens); 0: all");
  app.add_option("--stream-idle-seconds", options.stream_idle_s,
                 "how long a robot on a stream may stay silent or leave its answer unread [s]");
  app.add_option("--max-memory-bytes", options.max_memory_bytes,
                 "for requests that are being received or wait, of all clients [bytes]");
  app.add_option("--receive-seconds", options.receive_s,
                 "how long a request may take to arrive once its call has begun [s]");
  app.add_option("--reflection", options.reflection,
                 "tell of the services by gRPC server reflection (true, false)");
  app.add_option("--catalogue", options.catalogue.catalogue,
                 "serve the regions of a catalogue as robots ask for them, too: "
                 "postgresql://USER@HOST/DATABASE, or a folder; needs --store and --cache-dir")
      ->type_name("URL");
  app.add_option("--store", options.catalogue.store,
                 "where their maps are: s3://BUCKET/PREFIX?endpoint=URL&region=NAME, "
                 "http(s)://HOST/PATH, or a folder")
      ->type_name("URL");
  app.add_option("--cache-dir", options.catalogue.cache_dir,
                 "folder for the maps that were fetched, of this server alone")
      ->type_name("DIR");
  app.add_option(
      "--cache-bytes", line.cache_bytes,
      "with --cache-dir: of the disk that its maps may take (20 GiB); without: memory for "
      "what was read last of maps that stay in their files (256 MiB) [bytes]");
  app.add_option("--whole-bytes", options.whole_bytes,
                 "map files of up to so many bytes are read into memory as a whole; of larger ones "
                 "only the keys are, and the rest as it is asked for [bytes]");
  app.add_flag("--allow-slow-methods", options.allow_slow_methods,
               "take the methods with -brute and -naive, of which one query may take a thread for "
               "seconds");
  app.add_option("--max-rate", options.max_rate_per_s,
                 "requests a second of one client (token, else certificate, else address) [1/s]; "
                 "0: as many as it likes");
  app.add_option("--max-points", options.max_points, "points of one scan");
  app.add_option("--max-candidates", options.max_candidates,
                 "candidates that one query may have compared");
  app.add_option("--metrics-listen", options.metrics_listen,
                 "HOST:PORT for Prometheus, at /metrics over HTTP; none if not given");
  app.add_flag("--allow-plaintext-metrics", options.allow_plaintext_metrics,
               "serve metrics beyond this machine, where nothing protects them; --allow-plaintext "
               "says so, too");
  app.add_option("--capture-dir", options.capture_dir,
                 "keep queries without a place in this folder, made if need be, for scanloc locate "
                 "--replay")
      ->type_name("DIR");
  app.add_option("--max-capture-bytes", options.max_capture_bytes,
                 "of the disk that its files may take; the oldest go first [bytes]");
  app.add_option("--recent-answers", options.recent_answers,
                 "answers kept in memory for a live view by tokens of the roles view and admin, "
                 "or by everybody where there is no token file; 0: none");
  app.add_option("--map-health-seconds", options.map_health_s,
                 "how often to write into MAP.health, beside each map, how its places fare in use "
                 "(scanloc info --health); 0: not counted [s]");
  Choose<RequestLog>(
      app.add_option("--log-requests", options.log_requests,
                     "requests that get a line in the log, at most 100 a second"),
      {{"none", RequestLog::kNone}, {"failed", RequestLog::kFailed}, {"all", RequestLog::kAll}})
      ->default_str("failed");
  Choose<LogFormat>(
      app.add_option("--log-format", line.log_format, "text for people, or a JSON object a line"),
      {{"text", LogFormat::kText}, {"json", LogFormat::kJson}})
      ->default_str("text");
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.config_formatter(line.config);
  line.config->KnowFlagsOf(app);
  app.set_config("--config", "",
                 "read options from this TOML file; the command line goes before it")
      ->type_name("FILE")
      ->check([](const std::string& path) {
        return std::string(OpenRegularFile(path).status().message());
      });
  app.add_option("--log-level", line.log_level, "what to log on stderr")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}));
  app.add_option("--probe", line.probe.address,
                 "ask the server at HOST:PORT whether it serves, and exit with 0 or 1: for the "
                 "health check of a container; nothing is served. Over TLS with --tls-ca or "
                 "--tls-cert and --tls-key, which it shows")
      ->type_name("HOST:PORT");
  app.add_option("--tls-ca", line.probe.ca_file,
                 "CA that the server's certificate must be of for --probe, PEM; not checked if not "
                 "given")
      ->type_name("FILE");
  app.set_version_flag("--version", std::string("scanlocd ") + BuildVersion());
  app.footer(kExamples);
  cli::ShowDefaults(app);
  cli::RefuseEmptyValues(app);
}

int Fail(int exit_status, const absl::Status& status) {
  std::cerr << "scanlocd: " << Printable(std::string(status.message())) << '\n';
  return exit_status;
}

int Run(CommandLine line) {
  if (!line.probe.address.empty()) {
    line.probe.cert_file = line.options.tls.cert_file;
    line.probe.key_file = line.options.tls.key_file;
    const absl::Status status = ProbeHealth(line.probe);
    return status.ok() ? 0 : Fail(kExitFailed, status);
  }
  for (const std::string& text : line.maps) {
    const auto source = ParseMapSource(text);
    if (!source.ok()) return Fail(kExitUsage, source.status());
    line.options.maps.push_back(*source);
  }
  if (line.cache_bytes) {
    (line.options.catalogue.cache_dir.empty() ? line.options.cache_bytes
                                              : line.options.catalogue.cache_bytes) =
        *line.cache_bytes;
  }
  if (auto status = Validate(line.options); !status.ok()) return Fail(kExitUsage, status);

  KeepLittleFreedMemory();
  StartLogging(spdlog::level::from_str(line.log_level), line.log_format);
  RouteLibraryLogs();
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a file as long as files may be is an error of the write
  if (auto status = RaiseDescriptorLimit(); !status.ok()) return Fail(kExitFailed, status);
  // Debian builds abseil to look for deadlocks at every lock that gRPC takes, and to remember them.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  const mapdb::OpenOptions open{.cache = mapdb::MakePayloadCache(line.options.cache_bytes),
                                .whole_bytes = line.options.whole_bytes,
                                .num_readers = line.options.num_threads};
  const auto load = [open](const std::string& path, const Map* before) {
    mapdb::OpenOptions options = open;
    options.before = before;
    return mapdb::OpenMap(path, options);
  };
  const auto server =
      Server::Start(line.options, load, [cache = open.cache] { return mapdb::HeldBytes(*cache); });
  if (!server.ok()) return Fail(kExitFailed, server.status());
  return RunUntilStopped(**server, std::chrono::duration<double>(line.options.drain_s));
}

}  // namespace
}  // namespace scanloc::server

int main(int argc, char** argv) {
  scanloc::server::BlockStopSignals();  // one that comes before it serves is heeded once it does
  try {
    CLI::App app("Answers robots that wake up somewhere in a mapped town.", "scanlocd");
    scanloc::server::CommandLine line;
    scanloc::server::Declare(app, line);
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      const CLI::results_t& paths = app.get_config_ptr()->results();
      const std::string path = paths.empty() ? "" : paths.front();
      const auto in_file = line.config->Explain(error, path, {argv + 1, argv + argc});
      if (!in_file) return app.exit(error) == 0 ? 0 : scanloc::server::kExitUsage;
      std::cerr << "scanlocd: " << scanloc::Printable(*in_file) << '\n';
      return scanloc::server::kExitUsage;
    }
    return scanloc::server::Run(std::move(line));
  } catch (const std::exception& error) {
    std::cerr << "scanlocd: " << scanloc::Printable(error.what()) << '\n';
    return scanloc::server::kExitFailed;
  }
}
