#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "front/memory_bound.hpp"
#include "maps/map_sources.hpp"
#include "ops/metrics.hpp"
#include "rpc/health_service.hpp"
#include "scanloc/server/map_registry.hpp"
#include "scanloc/server/server.hpp"

namespace scanloc::server {

/// Loads, replaces and unloads the maps of a server, and has its health and metrics say which
/// answer. LoadAll and ReloadAll load one map at a time, since each may be as large as memory
/// allows; the load of one map makes nobody wait who asks for another. Thread-safe.
class MapKeeper {
 public:
  /// Registry, health, metrics and memory, which is told what loads, must outlive the keeper.
  MapKeeper(MapSources sources, MapLoader load_map, MapRegistry& maps, HealthService& health,
            Metrics& metrics, MemoryBound& memory);

  /// Has health and metrics know all maps before any is loaded. An error if the maps folder cannot
  /// be read.
  [[nodiscard]] absl::Status ExpectAll();

  /// Server::LoadMaps and Server::ReloadMaps.
  [[nodiscard]] absl::Status LoadAll();
  void ReloadAll();

  /// Server::ReloadMap, LoadMap, UnloadMap.
  [[nodiscard]] absl::Status Reload(const std::string& name);
  [[nodiscard]] absl::Status LoadNew(const std::string& name);
  [[nodiscard]] absl::Status Unload(const std::string& name);

  /// What is at many maps stops after the one at hand.
  void Stop() { is_stopping_ = true; }

 private:
  [[nodiscard]] absl::Status Load(const MapSource& source);
  [[nodiscard]] bool IsKnown(const std::string& name) const;

  void ForgetFailedAndGone();
  /// Held by who loads or removes the map.
  [[nodiscard]] std::mutex& MutexOf(const std::string& name);

  // With the map's mutex held.
  [[nodiscard]] absl::Status LoadNow(const MapSource& source);
  [[nodiscard]] absl::Status PutInService(const MapSource& source, Map map);
  [[nodiscard]] absl::Status Remove(const std::string& name);

  // With mutex_ held, which is taken after a map's.
  void Expect(const std::string& name);
  /// The server as such serves once every map has been tried, and while any answers.
  void TellHealth();

  const MapSources sources_;
  const MapLoader load_map_;
  MapRegistry& maps_;
  HealthService& health_;
  Metrics& metrics_;
  MemoryBound& memory_;
  std::atomic<bool> is_stopping_ = false;
  std::mutex mutex_;
  std::map<std::string, std::mutex> map_mutexes_;  // one for every name there ever was
  bool have_all_been_tried_ = false;
};

}  // namespace scanloc::server
