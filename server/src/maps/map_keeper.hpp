#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "absl/status/status.h"
#include "front/memory_bound.hpp"
#include "maps/map_sources.hpp"
#include "maps/use_book.hpp"
#include "ops/metrics.hpp"
#include "rpc/health_service.hpp"
#include "scanloc/server/map_registry.hpp"
#include "scanloc/server/server.hpp"

namespace scanloc::server {

/// Checks what of the maps in service stays in their files, one map after the other, in the
/// background and behind whatever else the machine has to do. Thread-safe.
class MapScrubber {
 public:
  struct Callbacks {
    /// So many places are sound.
    std::function<void(const ServedMap& map, std::size_t num_done)> progress;
    /// It is sound, or DataLoss; whatever else kept it from being checked.
    std::function<void(const std::shared_ptr<const ServedMap>& map, const absl::Status& status)>
        done;
  };
  explicit MapScrubber(Callbacks callbacks);
  ~MapScrubber();

  /// Has no effect on a map that is in memory as a whole. A map that went out of service meanwhile
  /// is passed over.
  void Add(std::shared_ptr<const ServedMap> map);
  /// Ends the check at hand; no callback comes after it.
  void Stop();

 private:
  void Work();

  const Callbacks callbacks_;
  std::mutex mutex_;
  std::condition_variable has_news_;
  std::deque<std::shared_ptr<const ServedMap>> waiting_;
  bool is_stopping_ = false;
  std::thread thread_;  // started with the first map
};

/// Loads, replaces and unloads the maps of a server, and has its health and metrics say which
/// answer. LoadAll and ReloadAll load one map at a time, since each may be as large as memory
/// allows; the load of one map makes nobody wait who asks for another. Thread-safe.
class MapKeeper {
 public:
  /// Registry, health, metrics, memory, which is told what loads, and uses must outlive the keeper.
  MapKeeper(MapSources sources, MapLoader load_map, MapRegistry& maps, HealthService& health,
            Metrics& metrics, MemoryBound& memory, UseBook& uses);

  /// Has health and metrics know all maps before any is loaded. An error if the maps folder cannot
  /// be read.
  [[nodiscard]] absl::Status ExpectAll();

  /// Server::LoadMaps and Server::ReloadMaps.
  [[nodiscard]] absl::Status LoadAll();
  void ReloadAll();

  /// Puts the map of a file in service under a name that need not be known before, in place of the
  /// one that is.
  [[nodiscard]] absl::Status LoadFile(const MapSource& source) { return Load(source); }

  /// The server as such serves without a map, too: it fetches what it is asked for.
  void ServeWithoutMaps();

  /// Server::ReloadMap, LoadMap, UnloadMap.
  [[nodiscard]] absl::Status Reload(const std::string& name);
  [[nodiscard]] absl::Status LoadNew(const std::string& name);
  [[nodiscard]] absl::Status Unload(const std::string& name);

  /// From then on told the name of every map that is taken out because it is damaged.
  void OnDamage(std::function<void(const std::string& name)> tell) {
    tell_damage_ = std::move(tell);
  }

  /// Takes a map out of service that was found damaged, by whoever read it.
  void TakeOut(const ServedMap& map, const absl::Status& why);

  /// What is at many maps stops after the one at hand, and nothing is checked any more.
  void Stop();

 private:
  [[nodiscard]] absl::Status Load(const MapSource& source);
  [[nodiscard]] bool IsKnown(const std::string& name) const;

  void ForgetFailedAndGone();
  /// Held by who loads or removes the map.
  [[nodiscard]] std::mutex& MutexOf(const std::string& name);

  // With the map's mutex held.
  [[nodiscard]] absl::Status LoadNow(const MapSource& source);
  [[nodiscard]] absl::Status PutInService(const MapSource& source, Map map);
  /// Whether the map in service under the name is the same.
  [[nodiscard]] bool IsInService(const std::string& name, const Map& map) const;
  void NoteScrubbed(const ServedMap& map, const absl::Status& status);
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
  UseBook& uses_;
  std::atomic<bool> is_stopping_ = false;
  std::mutex mutex_;
  std::map<std::string, std::mutex> map_mutexes_;  // one for every name there ever was
  bool have_all_been_tried_ = false;
  bool serves_without_maps_ = false;
  std::function<void(const std::string& name)> tell_damage_;
  MapScrubber scrubber_;  // last: its thread uses all of the above
};

}  // namespace scanloc::server
