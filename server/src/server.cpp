#include "scanloc/server/server.hpp"

#include <grpc/support/time.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "access.hpp"
#include "admin_service.hpp"
#include "connection_limits.hpp"
#include "credentials.hpp"
#include "grpc/health/v1/health.grpc.pb.h"
#include "health_service.hpp"
#include "localization_service.hpp"
#include "map_keeper.hpp"
#include "map_sources.hpp"
#include "metrics.hpp"
#include "metrics_endpoint.hpp"
#include "query_capture.hpp"
#include "reception.hpp"
#include "reflection_service.hpp"
#include "scanloc/v1/admin.grpc.pb.h"
#include "scanloc/v1/localization.grpc.pb.h"
#include "tls_files.hpp"
#include "unary_call.hpp"
#include "waiting_room.hpp"

namespace scanloc::server {
namespace {

int NumThreads(const ServerOptions& options) {
  if (options.num_threads > 0) return options.num_threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// A request that is there so soon counts for nothing while it is received.
constexpr std::chrono::milliseconds kReceivedAtOnce(250);

/// How long a request may take to arrive once the server drains.
constexpr std::chrono::seconds kReceiveGrace(1);

/// Requests of the largest size that may be on their way at once.
int MaxReceiving(const ServerOptions& options) {
  return static_cast<int>(
      std::clamp<std::int64_t>(options.max_memory_bytes / LargestMessageBytes(options), 1, 4096));
}

std::vector<std::string> ServicesOf(const ServerOptions& options) {
  std::vector<std::string> services = {v1::Localization::service_full_name(),
                                       grpc::health::v1::Health::service_full_name()};
  if (options.admin) services.emplace_back(v1::Admin::service_full_name());
  return services;
}

}  // namespace

struct Server::State {
  State(const ServerOptions& server_options, MapLoader loader, std::unique_ptr<Access> callers,
        const std::function<std::unique_ptr<QueryCapture>(Metrics&)>& open_capture)
      : options(server_options),
        access(std::move(callers)),
        workers(NumThreads(server_options), server_options.max_inflight, server_options.max_wait_s),
        metrics([this] { return Look(); }),
        capture(open_capture(metrics)),
        reception(*access, metrics, server_options.max_rate_per_s, server_options.log_requests),
        inbox({.max_waiters = MaxReceiving(server_options),
               .grace = kReceivedAtOnce,
               .timeout = std::chrono::duration<double>(server_options.receive_s),
               .full = "the server receives as many requests as its memory allows; try again later",
               .expired = absl::StrCat("the request did not arrive within ",
                                       server_options.receive_s, " s")}),
        localization(
            maps, workers, inbox, reception, metrics, capture.get(),
            {.streams = {.max_streams = server_options.max_streams,
                         .max_per_client = server_options.max_streams_per_client,
                         .idle = std::chrono::duration<double>(server_options.stream_idle_s)},
             .max_points = static_cast<std::size_t>(server_options.max_points),
             .max_candidates = server_options.max_candidates,
             .allow_slow_methods = server_options.allow_slow_methods,
             .max_waiting_bytes = server_options.max_memory_bytes / 2}),
        admin(maps, inbox, reception,
              {.reload = [this](const std::string& name) { return keeper.Reload(name); },
               .load = [this](const std::string& name) { return keeper.LoadNew(name); },
               .unload = [this](const std::string& name) { return keeper.Unload(name); }}),
        health(std::chrono::duration<double>(server_options.receive_s)),
        keeper(MapSources(server_options.maps, server_options.maps_dir), std::move(loader), maps,
               health, metrics),
        reflection(ServicesOf(server_options)) {}

  // gRPC ends every call, then the workers what they were at; only then goes what both use.
  ~State() {
    metrics_endpoint.reset();
    grpc_server.reset();
    workers.Finish();
    admin.Finish();
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  absl::Status Listen();
  [[nodiscard]] Metrics::Gauges Look() const;

  const ServerOptions options;
  std::string address;
  const std::unique_ptr<Access> access;
  MapRegistry maps;
  WorkerPool workers;
  Metrics metrics;
  const std::unique_ptr<QueryCapture> capture;
  Reception reception;
  WaitingRoom inbox;  // requests on their way
  LocalizationService localization;
  AdminService admin;
  HealthService health;
  MapKeeper keeper;
  ReflectionService reflection;
  std::atomic<bool> stopping = false;
  std::once_flag shutdown;
  std::unique_ptr<TlsFiles> tls;
  std::shared_ptr<grpc::ServerCredentials> credentials;
  std::unique_ptr<grpc::Server> grpc_server;
  std::unique_ptr<MetricsEndpoint> metrics_endpoint;  // last: it looks at all of the above
};

Metrics::Gauges Server::State::Look() const {
  const WorkerPool::Load load = workers.load();
  return {.num_waiting = load.num_waiting,
          .num_running = load.num_running,
          .num_streams = localization.num_streams(),
          .is_draining = stopping,
          .maps = maps.List()};
}

absl::Status Server::State::Listen() {
  if (auto status = keeper.ExpectAll(); !status.ok()) return status;
  if (!options.metrics_listen.empty()) {
    auto endpoint = MetricsEndpoint::Listen(options.metrics_listen, metrics);
    if (!endpoint.ok()) return endpoint.status();
    metrics_endpoint = *std::move(endpoint);
    spdlog::info("metrics on http://{}/metrics", metrics_endpoint->address());
  }
  if (options.tls.enabled()) {
    auto files = TlsFiles::Open(options.tls, metrics);
    if (!files.ok()) return files.status();
    tls = *std::move(files);
  }
  credentials = MakeCredentials(tls.get());
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(options.listen, credentials, &port);
  builder.RegisterService(&localization);
  builder.RegisterService(&health);
  if (options.admin) builder.RegisterService(&admin);
  if (options.reflection) builder.RegisterService(&reflection);
  builder.SetMaxReceiveMessageSize(LargestMessageBytes(options));
  LimitConnections(builder, options.max_memory_bytes);
  grpc_server = builder.BuildAndStart();
  if (grpc_server == nullptr || port == 0) {
    return absl::UnavailableError(
        absl::StrCat("cannot listen on ", options.listen,
                     "; is the host one of this machine's, and is the port free and allowed?"));
  }
  address = absl::StrCat(options.listen.substr(0, options.listen.rfind(':')), ":", port);
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<Server>> Server::Start(const ServerOptions& options,
                                                      MapLoader load_map) {
  if (auto status = Validate(options); !status.ok()) return status;
  std::unique_ptr<State> state;
  const absl::Status status = Guard([&] {
    auto access = Access::Create(options.token_file);
    if (!access.ok()) return access.status();
    absl::Status captures;
    state = std::make_unique<State>(options, std::move(load_map), *std::move(access),
                                    [&](Metrics& metrics) -> std::unique_ptr<QueryCapture> {
                                      if (options.capture_dir.empty()) return nullptr;
                                      auto capture = QueryCapture::Open(
                                          options.capture_dir, options.max_capture_bytes, metrics);
                                      captures = capture.status();
                                      return capture.ok() ? *std::move(capture) : nullptr;
                                    });
    if (!captures.ok()) return captures;
    return state->Listen();
  });
  if (!status.ok()) return status;
  return std::unique_ptr<Server>(new Server(std::move(state)));
}

Server::Server(std::unique_ptr<State> state) : state_(std::move(state)) {}

Server::~Server() { Shutdown(); }

const std::string& Server::address() const { return state_->address; }
std::string Server::metrics_address() const {
  return state_->metrics_endpoint ? state_->metrics_endpoint->address() : std::string();
}
std::string Server::MetricsText() const { return state_->metrics.Text(); }
MapRegistry& Server::maps() { return state_->maps; }
WorkerPool& Server::workers() { return state_->workers; }

absl::Status Server::LoadMaps() { return state_->keeper.LoadAll(); }
absl::Status Server::ReloadMap(const std::string& name) { return state_->keeper.Reload(name); }
absl::Status Server::LoadMap(const std::string& name) { return state_->keeper.LoadNew(name); }
absl::Status Server::UnloadMap(const std::string& name) { return state_->keeper.Unload(name); }
void Server::ReloadMaps() { state_->keeper.ReloadAll(); }

void Server::Shutdown() {
  std::call_once(state_->shutdown, [this] {
    state_->stopping = true;
    state_->keeper.Stop();
    state_->health.StartDraining();
    state_->localization.Drain();
    state_->reflection.Drain();
    state_->inbox.Drain(kReceiveGrace);
    const auto drain_ns = static_cast<std::int64_t>(1e9 * state_->options.drain_s);
    state_->grpc_server->Shutdown(
        gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC), gpr_time_from_nanos(drain_ns, GPR_TIMESPAN)));
  });
}

}  // namespace scanloc::server
