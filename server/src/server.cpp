#include "scanloc/server/server.hpp"

#include <grpc/support/time.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <malloc.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "access.hpp"
#include "admin_service.hpp"
#include "connection_limits.hpp"
#include "credentials.hpp"
#include "grpc/health/v1/health.grpc.pb.h"
#include "health_service.hpp"
#include "localization_service.hpp"
#include "map_sources.hpp"
#include "metrics.hpp"
#include "query_capture.hpp"
#include "reception.hpp"
#include "reflection_service.hpp"
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

/// A map is read on a thread of its own, and what it or the one before held would stay with the
/// allocator, a little more of it after every reload.
void ReturnFreedMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace

std::string HealthName(const std::string& map_name) {
  return absl::StrCat("scanloc.map/", map_name);
}

struct Server::State {
  State(const ServerOptions& server_options, MapLoader loader, std::unique_ptr<Access> callers,
        const std::function<std::unique_ptr<QueryCapture>(Metrics&)>& open_capture)
      : options(server_options),
        load_map(std::move(loader)),
        access(std::move(callers)),
        sources(server_options.maps, server_options.maps_dir),
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
        admin(maps, reception,
              {.reload = [this](const std::string& name) { return Reload(name); },
               .load = [this](const std::string& name) { return LoadNew(name); },
               .unload = [this](const std::string& name) { return Unload(name); }}),
        health(inbox),
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
  [[nodiscard]] bool IsKnown(const std::string& name) const;
  absl::Status Load(const MapSource& source);

  // The next five with `loading` held.
  void Expect(const std::string& name);
  absl::Status LoadNow(const MapSource& source);
  absl::Status PutInService(const MapSource& source, Map map);
  absl::Status Remove(const std::string& name);
  void ForgetFailedAndGone();

  absl::Status Reload(const std::string& name);
  absl::Status LoadNew(const std::string& name);
  absl::Status Unload(const std::string& name);
  [[nodiscard]] Metrics::Gauges Look() const;

  const ServerOptions options;
  const MapLoader load_map;
  std::string address;
  const std::unique_ptr<Access> access;
  const MapSources sources;
  MapRegistry maps;
  WorkerPool workers;
  Metrics metrics;
  const std::unique_ptr<QueryCapture> capture;
  Reception reception;
  WaitingRoom inbox;  // requests on their way
  LocalizationService localization;
  AdminService admin;
  HealthService health;
  ReflectionService reflection;
  std::atomic<bool> stopping = false;
  std::once_flag shutdown;
  std::mutex loading;  // one map at a time: each may be as large as memory allows
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
  health.Set("", false);
  const auto known = sources.List();
  if (!known.ok()) return known.status();
  {
    const std::lock_guard lock(loading);
    for (const MapSource& source : *known) Expect(source.name);
  }

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

absl::Status Server::State::Load(const MapSource& source) {
  const std::lock_guard lock(loading);
  return LoadNow(source);
}

absl::Status Server::State::LoadNow(const MapSource& source) {
  Expect(source.name);
  const std::int64_t start_ns = NowNs();
  spdlog::debug("loading map {} from {}", source.name, source.path);
  absl::Status status = Guard([&]() -> absl::Status {
    auto map = load_map(source.path);
    if (!map.ok()) return map.status();
    return PutInService(source, *std::move(map));
  });
  ReturnFreedMemory();
  if (status.ok()) health.Set(HealthName(source.name), true);
  metrics.SetLoadTime(source.name, 1e-9 * static_cast<double>(NowNs() - start_ns));
  if (status.ok()) return status;
  metrics.CountFailedLoad(source.name);
  maps.SetFailed(source.name);
  return {status.code(), absl::StrCat("map ", source.name, ": ", status.message())};
}

absl::Status Server::State::PutInService(const MapSource& source, Map map) {
  if (const auto served = maps.Find(source.name); served.ok()) {
    const Map& now = (*served)->localizer->map();
    if (now.content_id == map.content_id && now.calibration == map.calibration &&
        now.confusable == map.confusable) {
      spdlog::info("map {} is unchanged", source.name);
      return absl::OkStatus();
    }
  }
  const std::size_t num_places = map.places.size();
  const std::string content_id = map.content_id;
  if (auto status = maps.Serve(source.name, source.path, std::move(map)); !status.ok()) {
    return status;
  }
  spdlog::info("map {} in service: {} places, content id {}", source.name, num_places, content_id);
  return absl::OkStatus();
}

absl::Status Server::LoadMaps() {
  const auto sources = state_->sources.List();
  if (!sources.ok()) return sources.status();
  absl::Status first_error;
  std::size_t num_loaded = 0;
  for (const MapSource& source : *sources) {
    const absl::Status status = state_->Load(source);
    if (state_->stopping) return absl::CancelledError("the server was stopped while loading maps");
    if (status.ok()) {
      ++num_loaded;
      continue;
    }
    if (first_error.ok()) first_error = status;
    // Alone, it is told by who called; among others it must not go unseen.
    if (sources->size() > 1) spdlog::error("{}", absl::StrCat(status.message()));
  }
  if (num_loaded == 0 && !first_error.ok()) return first_error;
  state_->health.Set("", true);
  return absl::OkStatus();
}

void Server::State::Expect(const std::string& name) {
  if (IsKnown(name)) return;
  maps.Add(name);
  health.Set(HealthName(name), false);
  metrics.StartCountingLoads(name);
}

bool Server::State::IsKnown(const std::string& name) const {
  const std::vector<MapSummary> known = maps.List();
  return std::any_of(known.begin(), known.end(),
                     [&](const MapSummary& map) { return map.name == name; });
}

absl::Status Server::State::Reload(const std::string& name) {
  const std::lock_guard lock(loading);
  if (!IsKnown(name)) {
    return absl::NotFoundError(absl::StrCat("no map is named ", absl::Utf8SafeCHexEscape(name)));
  }
  const auto source = sources.Find(name);
  if (!source.ok()) return source.status();
  return LoadNow(*source);
}

absl::Status Server::State::LoadNew(const std::string& name) {
  const std::lock_guard lock(loading);
  if (!name.empty() && maps.Find(name).ok()) {
    return absl::AlreadyExistsError(absl::StrCat("map ", name, " is in service; reload it"));
  }
  const auto source = sources.Find(name);
  if (!source.ok()) return source.status();
  return LoadNow(*source);
}

absl::Status Server::State::Unload(const std::string& name) {
  const std::lock_guard lock(loading);
  return Remove(name);
}

absl::Status Server::State::Remove(const std::string& name) {
  if (auto status = maps.Remove(name); !status.ok()) return status;
  health.Set(HealthName(name), false);
  spdlog::info("map {} out of service", name);
  return absl::OkStatus();
}

void Server::State::ForgetFailedAndGone() {
  for (const MapSummary& map : maps.List()) {
    if (map.state != MapState::kFailed || sources.Find(map.name).ok()) continue;
    if (auto status = Remove(map.name); !status.ok()) spdlog::error("{}", status.ToString());
  }
}

absl::Status Server::ReloadMap(const std::string& name) { return state_->Reload(name); }
absl::Status Server::LoadMap(const std::string& name) { return state_->LoadNew(name); }
absl::Status Server::UnloadMap(const std::string& name) { return state_->Unload(name); }

void Server::ReloadMaps() {
  const auto sources = state_->sources.List();
  if (!sources.ok()) return spdlog::error("{}", absl::StrCat(sources.status().message()));
  {
    const std::lock_guard lock(state_->loading);
    state_->ForgetFailedAndGone();
  }
  for (const MapSource& source : *sources) {
    if (state_->stopping) return;
    const absl::Status status = state_->Load(source);
    if (!status.ok()) spdlog::error("not reloaded: {}", absl::StrCat(status.message()));
  }
}

void Server::Shutdown() {
  std::call_once(state_->shutdown, [this] {
    state_->stopping = true;
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
