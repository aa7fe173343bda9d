#pragma once

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "scanloc/server/server.hpp"

/// Real servers on free ports of this machine, inside the test.
namespace scanloc::test {

/// Holds threads until it is opened.
class Gate {
 public:
  void Open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
    changed_.notify_all();
  }
  void Wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return open_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = false;
};

using Maps = std::map<std::string, Map>;

/// A loader that finds the maps by name, as if each were the file of that name in any folder.
inline server::MapLoader LoaderOf(Maps maps) {
  return [maps = std::move(maps)](const std::string& path, const Map*) -> absl::StatusOr<Map> {
    const auto found = maps.find(std::filesystem::path(path).filename());
    if (found == maps.end()) return absl::NotFoundError(absl::StrCat("no such map ", path));
    return found->second;
  };
}

/// Options that serve the maps on a free port.
inline server::ServerOptions OptionsFor(const Maps& maps) {
  server::ServerOptions options;
  for (const auto& [name, map] : maps) options.maps.push_back({.name = name, .path = name});
  options.listen = "127.0.0.1:0";
  options.num_threads = 2;
  options.map_health_s = 0.0;  // those files are none
  options.max_wait_s = 60.0;   // under a sanitizer a few queries at once are a long queue
  return options;
}

/// A server that answers for the maps.
inline std::unique_ptr<server::Server> StartServer(const Maps& maps,
                                                   const server::ServerOptions& options) {
  auto server = server::Server::Start(options, LoaderOf(maps));
  if (!server.ok()) throw std::runtime_error(server.status().ToString());
  if (auto status = (*server)->LoadMaps(); !status.ok()) {
    throw std::runtime_error(status.ToString());
  }
  return *std::move(server);
}
inline std::unique_ptr<server::Server> StartServer(const Maps& maps) {
  return StartServer(maps, OptionsFor(maps));
}

}  // namespace scanloc::test
