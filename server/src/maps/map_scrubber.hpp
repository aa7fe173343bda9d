#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "absl/status/status.h"
#include "scanloc/server/map_registry.hpp"

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

}  // namespace scanloc::server
