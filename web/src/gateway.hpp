#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "place_tiles.hpp"
#include "scanloc/client/client.hpp"

namespace scanloc::web {

/// The way to the server: as the caller, by his token. Thread-safe.
class Gateway {
 public:
  /// Callers with tokens of their own whose connections to the server are kept.
  static constexpr std::size_t kMaxClients = 64;

  /// The options' token is that of callers without one.
  explicit Gateway(client::ClientOptions options) : options_(std::move(options)) {}

  /// A client that shows the token. Errors as of client::Client::Connect, but it does not wait for
  /// the server.
  [[nodiscard]] absl::StatusOr<std::shared_ptr<const client::Client>> As(const std::string& token);

  /// The places of the map, which are fetched once for each content; the caller may know of the
  /// map, or it is an error.
  [[nodiscard]] absl::StatusOr<std::shared_ptr<const PlaceTiles>> TilesOf(
      const client::Client& caller, const std::string& map);

  [[nodiscard]] const std::string& address() const { return options_.address; }

 private:
  static constexpr std::size_t kMaxMaps = 16;

  /// One is fetched at a time.
  struct Slot {
    std::mutex fetching;
    std::shared_ptr<const PlaceTiles> tiles;
  };

  [[nodiscard]] std::shared_ptr<Slot> SlotOf(const std::string& map);

  const client::ClientOptions options_;
  std::mutex mutex_;
  std::list<std::pair<std::string, std::shared_ptr<const client::Client>>>
      clients_;                                                     // newest first
  std::list<std::pair<std::string, std::shared_ptr<Slot>>> slots_;  // likewise
};

}  // namespace scanloc::web
