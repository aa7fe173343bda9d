#pragma once

#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/map/map.hpp"
#include "scanloc/server/map_registry.hpp"
#include "scanloc/server/server_options.hpp"
#include "scanloc/server/worker_pool.hpp"

namespace scanloc::server {

/// Reads the map at a path, which takes the place of one in service, or of none (null); what is
/// equal in both it may share. mapdb::OpenMap in the program.
using MapLoader = std::function<absl::StatusOr<Map>(const std::string& path, const Map* before)>;

/// The health service (grpc.health.v1) knows the server as a whole as "", which serves once every
/// map was loaded or passed over, and each map under this name.
[[nodiscard]] std::string HealthName(const std::string& map_name);
/// That serves once all of the map was checked; before, queries are answered with what each reads
/// being checked.
[[nodiscard]] std::string CheckedHealthName(const std::string& map_name);

/// A running scanlocd: listens from Start on, with every map NOT_SERVING until it is loaded.
/// Thread-safe.
class Server {
 public:
  /// InvalidArgument: bad options. Unavailable: cannot listen there. kept_bytes: what is kept now
  /// of what was read of maps after they were loaded; null: nothing.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<Server>> Start(
      const ServerOptions& options, MapLoader load_map,
      std::function<std::int64_t()> kept_bytes = nullptr);

  /// Shutdown, if it was not called yet.
  ~Server();

  /// HOST:PORT as configured, with the port that was really taken.
  [[nodiscard]] const std::string& address() const;

  /// Likewise of the metrics; empty where none are served.
  [[nodiscard]] std::string metrics_address() const;

  /// What is served there, in Prometheus' text format.
  [[nodiscard]] std::string MetricsText() const;

  /// Loads every map in turn; each answers as soon as it is loaded. One that does not load is
  /// logged and passed over; why the first of them did not is returned if none does. Cancelled if
  /// Shutdown was called meanwhile. Call once, before the calls below.
  [[nodiscard]] absl::Status LoadMaps();

  /// Loads the map's file anew, beside the one in service, and puts it in service in its place;
  /// queries under way end with the one they began with. The same content and calibration: nothing
  /// changes. On error the one in service stays. NotFound: no map of that name is known.
  [[nodiscard]] absl::Status ReloadMap(const std::string& name);

  /// Puts a map in service that is configured or lies in the maps folder. AlreadyExists: it is in
  /// service. NotFound: there is none. Others: its file is bad; it is listed as failed until it is
  /// loaded or unloaded, and queries that name no map are answered as before.
  [[nodiscard]] absl::Status LoadMap(const std::string& name);

  /// Takes a map out of service; queries under way end with it. NotFound: no map of that name is
  /// known.
  [[nodiscard]] absl::Status UnloadMap(const std::string& name);

  /// ReloadMap for every map, and LoadMap for what is new in the maps folder; what fails is logged.
  /// A map whose file is gone stays in service; one that never was, and whose file is gone, is
  /// known no more.
  void ReloadMaps();

  /// Tells NOT_SERVING, accepts nothing more, waits up to drain_s for what is in flight, cancels
  /// what has not started by then, and returns when nothing runs any more.
  void Shutdown();

  [[nodiscard]] MapRegistry& maps();
  [[nodiscard]] WorkerPool& workers();

 private:
  struct State;
  explicit Server(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace scanloc::server
