#include "scanloc/server/server.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "admission/access.hpp"
#include "admission/admission.hpp"
#include "admission/idle_calls.hpp"
#include "front/guarded_front.hpp"
#include "front/memory_bound.hpp"
#include "front/tls_files.hpp"
#include "grpc/health/v1/health.grpc.pb.h"
#include "maps/catalogue_maps.hpp"
#include "maps/map_keeper.hpp"
#include "maps/map_sources.hpp"
#include "maps/use_book.hpp"
#include "ops/metrics.hpp"
#include "ops/metrics_endpoint.hpp"
#include "ops/query_capture.hpp"
#include "ops/recent_answers.hpp"
#include "rpc/admin_service.hpp"
#include "rpc/health_service.hpp"
#include "rpc/localization_service.hpp"
#include "rpc/reflection_service.hpp"
#include "rpc/unary_call.hpp"
#include "rpc/viewer_service.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/jobs/jobs.hpp"
#include "scanloc/v1/admin.grpc.pb.h"
#include "scanloc/v1/localization.grpc.pb.h"
#include "scanloc/v1/viewer.grpc.pb.h"

namespace scanloc::server {
namespace {

/// How long a request may take to arrive once the server drains, and an answer to be taken in.
constexpr std::chrono::seconds kDrainGrace(1);

/// What an answer on its way takes with its call, and some.
constexpr std::int64_t kAnswerBytes = std::int64_t{32} << 10;

/// Answers on their way, of those that are not taken in at once.
constexpr int kMaxSending = 4096;

/// What gRPC and the answers add to the requests of clients.
constexpr double kMemoryFactor = 1.25;

/// Requests of the largest size that may be on their way at once.
int MaxReceiving(const ServerOptions& options) {
  return static_cast<int>(
      std::clamp<std::int64_t>(options.max_memory_bytes / LargestMessageBytes(options), 1, 4096));
}

std::vector<std::string> ServicesOf(const ServerOptions& options) {
  std::vector<std::string> services = {v1::Localization::service_full_name(),
                                       v1::Viewer::service_full_name(),
                                       grpc::health::v1::Health::service_full_name()};
  if (options.admin) services.emplace_back(v1::Admin::service_full_name());
  return services;
}

}  // namespace

struct Server::State {
  State(const ServerOptions& server_options, MapLoader loader,
        std::function<std::int64_t()> kept_of_maps_bytes, std::unique_ptr<Access> callers,
        const std::function<std::unique_ptr<QueryCapture>(Metrics&)>& open_capture)
      : options(server_options),
        kept_bytes(std::move(kept_of_maps_bytes)),
        access(std::move(callers)),
        workers(static_cast<int>(NumThreads(server_options.num_threads)),
                server_options.max_inflight, server_options.max_wait_s),
        metrics([this] { return Look(); }),
        capture(open_capture(metrics)),
        recent(server_options.recent_answers),
        uses(std::chrono::duration<double>(server_options.map_health_s)),
        admission(*access, metrics, server_options.max_rate_per_s, server_options.log_requests),
        receiving(
            {.max_idle = MaxReceiving(server_options),
             .grace = IdleCalls::kReceivedAtOnce,
             .timeout = std::chrono::duration<double>(server_options.receive_s),
             .full = "the server receives as many requests as its memory allows; try again later",
             .expired = absl::StrCat("the request did not arrive within ", server_options.receive_s,
                                     " s")}),
        sending({.max_idle = kMaxSending,
                 .grace = IdleCalls::kReceivedAtOnce,
                 .timeout = std::chrono::duration<double>(server_options.receive_s),
                 .full = "as many answers as may are not taken in",
                 .expired = "the answer was not taken in"}),
        memory(static_cast<std::int64_t>(kMemoryFactor *
                                         static_cast<double>(server_options.max_memory_bytes))),
        localization(
            maps, workers, {receiving, sending}, admission, metrics, capture.get(),
            [this](const ServedMap& map, const absl::Status& why) { keeper.TakeOut(map, why); },
            recent,
            {.streams = {.max_streams = server_options.max_streams,
                         .max_per_client = server_options.max_streams_per_client,
                         .idle = std::chrono::duration<double>(server_options.stream_idle_s)},
             .max_points = static_cast<std::size_t>(server_options.max_points),
             .max_candidates = server_options.max_candidates,
             .allow_slow_methods = server_options.allow_slow_methods,
             .max_waiting_bytes = server_options.max_memory_bytes / 2}),
        viewer(maps, recent, {receiving, sending}, admission),
        admin(maps, {receiving, sending}, admission,
              {.reload = [this](const std::string& name) { return keeper.Reload(name); },
               .load = [this](const std::string& name) { return keeper.LoadNew(name); },
               .unload = [this](const std::string& name) { return keeper.Unload(name); }}),
        health(sending, std::chrono::duration<double>(server_options.receive_s)),
        keeper(MapSources(server_options.maps, server_options.maps_dir), std::move(loader), maps,
               health, metrics, memory, uses),
        reflection(ServicesOf(server_options)) {}

  // The front ends every call, then the workers what they were at; only then goes what both use.
  ~State() {
    metrics_endpoint.reset();
    front.reset();
    workers.Finish();
    admin.Finish();
  }

  absl::Status Listen();
  [[nodiscard]] Metrics::Gauges Look() const;
  [[nodiscard]] std::int64_t AtHandBytes() const;

  const ServerOptions options;
  const std::function<std::int64_t()> kept_bytes;
  const std::unique_ptr<Access> access;
  MapRegistry maps;
  WorkerPool workers;
  Metrics metrics;
  const std::unique_ptr<QueryCapture> capture;
  RecentAnswers recent;
  UseBook uses;
  Admission admission;
  IdleCalls receiving;  // requests on their way
  IdleCalls sending;    // answers on theirs
  MemoryBound memory;
  LocalizationService localization;
  ViewerService viewer;
  AdminService admin;
  HealthService health;
  MapKeeper keeper;
  std::unique_ptr<CatalogueMaps> catalogue_maps;  // null without a catalogue
  ReflectionService reflection;
  std::atomic<bool> stopping = false;
  std::once_flag shutdown;
  std::unique_ptr<TlsFiles> tls;
  std::unique_ptr<GuardedFront> front;
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

std::int64_t Server::State::AtHandBytes() const {
  const WorkerPool::Load load = workers.load();
  const std::int64_t num_at_hand =
      receiving.num_idle() + localization.num_streams() + load.num_waiting + load.num_running;
  return num_at_hand * LargestMessageBytes(options) + sending.num_idle() * kAnswerBytes;
}

absl::Status Server::State::Listen() {
  RETURN_IF_ERROR(keeper.ExpectAll());
  if (options.catalogue.enabled()) {
    ASSIGN_OR_RETURN(catalogue_maps, CatalogueMaps::Open(options.catalogue, keeper, maps, metrics));
    keeper.ServeWithoutMaps();
    keeper.OnDamage([this](const std::string& name) { catalogue_maps->Lost(name); });
    maps.OnUnknown([this](const std::string& name) { return catalogue_maps->Want(name); });
    maps.OnPlaceOnEarth(
        [this](const Prior::GeoDisc& disc) { return catalogue_maps->Elsewhere(disc); });
  }
  if (!options.metrics_listen.empty()) {
    ASSIGN_OR_RETURN(metrics_endpoint, MetricsEndpoint::Listen(options.metrics_listen, metrics));
    spdlog::info("metrics on http://{}/metrics", metrics_endpoint->address());
  }
  if (options.tls.enabled()) {
    ASSIGN_OR_RETURN(tls, TlsFiles::Open(options.tls, metrics));
  }
  GuardedFront::Options guarded{
      .listen = options.listen,
      .tls = tls.get(),
      .services = {&localization, &viewer, &health},
      .max_message_bytes = LargestMessageBytes(options),
      .max_memory_bytes = options.max_memory_bytes,
      .work_bytes =
          [this] { return localization.work_bytes() + (kept_bytes == nullptr ? 0 : kept_bytes()); },
      .at_hand_bytes = [this] { return AtHandBytes(); },
      .made_anew = [this](const std::string& why) { metrics.CountFrontMadeAnew(why); },
      .asked_itself = [this](bool is_answered) { metrics.CountSelfCheck(is_answered); }};
  if (options.admin) guarded.services.push_back(&admin);
  if (options.reflection) guarded.services.push_back(&reflection);
  ASSIGN_OR_RETURN(front, GuardedFront::Open(std::move(guarded), {receiving, sending}, memory));
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<Server>> Server::Start(const ServerOptions& options,
                                                      MapLoader load_map,
                                                      std::function<std::int64_t()> kept_bytes) {
  RETURN_IF_ERROR(Validate(options));
  std::unique_ptr<State> state;
  const absl::Status status = Guard([&] {
    ASSIGN_OR_RETURN(auto access, Access::Create(options.token_file));
    absl::Status captures;
    state = std::make_unique<State>(
        options, std::move(load_map), std::move(kept_bytes), std::move(access),
        [&](Metrics& metrics) -> std::unique_ptr<QueryCapture> {
          if (options.capture_dir.empty()) return nullptr;
          auto capture =
              QueryCapture::Open(options.capture_dir, options.max_capture_bytes, metrics);
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

const std::string& Server::address() const { return state_->front->address(); }
std::string Server::metrics_address() const {
  return state_->metrics_endpoint ? state_->metrics_endpoint->address() : std::string();
}
std::string Server::MetricsText() const { return state_->metrics.Text(); }
MapRegistry& Server::maps() { return state_->maps; }
WorkerPool& Server::workers() { return state_->workers; }

absl::Status Server::LoadMaps() {
  if (state_->catalogue_maps != nullptr) state_->catalogue_maps->Start();
  return state_->keeper.LoadAll();
}
absl::Status Server::ReloadMap(const std::string& name) { return state_->keeper.Reload(name); }
absl::Status Server::LoadMap(const std::string& name) { return state_->keeper.LoadNew(name); }
absl::Status Server::UnloadMap(const std::string& name) { return state_->keeper.Unload(name); }
void Server::ReloadMaps() { state_->keeper.ReloadAll(); }

void Server::Shutdown() {
  std::call_once(state_->shutdown, [this] {
    state_->stopping = true;
    if (state_->catalogue_maps != nullptr) state_->catalogue_maps->Stop();
    state_->keeper.Stop();
    state_->health.StartDraining();
    state_->localization.Drain();
    state_->reflection.Drain();
    state_->receiving.Drain(kDrainGrace);
    state_->sending.Drain(kDrainGrace);
    state_->front->Shutdown(std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::duration<double>(state_->options.drain_s)));
    state_->uses.Stop();
  });
}

}  // namespace scanloc::server
