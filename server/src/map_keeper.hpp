#pragma once

#include <atomic>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "health_service.hpp"
#include "map_sources.hpp"
#include "metrics.hpp"
#include "scanloc/server/map_registry.hpp"
#include "scanloc/server/server.hpp"

namespace scanloc::server {

/// Loads, replaces and unloads the maps of a server, and has its health and metrics say which
/// answer. Loads one map at a time: each may be as large as memory allows. Thread-safe.
class MapKeeper {
 public:
  /// Registry, health and metrics must outlive the keeper.
  MapKeeper(MapSources sources, MapLoader load_map, MapRegistry& maps, HealthService& health,
            Metrics& metrics);

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

  // All with mutex_ held.
  void Expect(const std::string& name);
  [[nodiscard]] absl::Status LoadNow(const MapSource& source);
  [[nodiscard]] absl::Status PutInService(const MapSource& source, Map map);
  [[nodiscard]] absl::Status Remove(const std::string& name);
  void ForgetFailedAndGone();
  /// The server as such serves once every map has been tried, and while any answers.
  void TellHealth();

  const MapSources sources_;
  const MapLoader load_map_;
  MapRegistry& maps_;
  HealthService& health_;
  Metrics& metrics_;
  std::atomic<bool> is_stopping_ = false;
  std::mutex mutex_;
  bool have_all_been_tried_ = false;
};

}  // namespace scanloc::server
