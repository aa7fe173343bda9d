#include "gateway.hpp"

#include <algorithm>

#include "scanloc/core/status_macros.hpp"

namespace scanloc::web {
namespace {

/// The value of the key, made if there is none, as the newest of at most so many.
template <typename Value, typename Make>
Value& Touch(std::list<std::pair<std::string, Value>>& entries, const std::string& key,
             std::size_t most, Make make) {
  const auto found =
      std::ranges::find_if(entries, [&key](const auto& entry) { return entry.first == key; });
  if (found != entries.end()) {
    entries.splice(entries.begin(), entries, found);
  } else {
    entries.emplace_front(key, make());
    if (entries.size() > most) entries.pop_back();
  }
  return entries.front().second;
}

absl::StatusOr<std::shared_ptr<const PlaceTiles>> Fetch(const client::Client& caller,
                                                        const std::string& map,
                                                        const std::string& content_id) {
  std::vector<Place> places;
  for (std::string token;;) {
    ASSIGN_OR_RETURN(auto page, caller.ListPlaces(map, token));
    if (page.content_id != content_id) {
      return absl::AbortedError("the map was replaced just now; ask again");
    }
    places.insert(places.end(), page.places.begin(), page.places.end());
    if (page.next_page_token.empty()) break;
    if (page.places.empty()) return absl::InternalError("the server's pages of places do not end");
    token = std::move(page.next_page_token);
  }
  return std::make_shared<const PlaceTiles>(content_id, places);
}

}  // namespace

absl::StatusOr<std::shared_ptr<const client::Client>> Gateway::As(const std::string& token) {
  const std::lock_guard lock(mutex_);
  absl::Status status;
  const std::string& key = token.empty() ? options_.token : token;
  auto& client = Touch(clients_, key, kMaxClients, [&]() -> std::shared_ptr<const client::Client> {
    client::ClientOptions options = options_;
    options.token = key;
    options.connect_timeout = {};
    auto connected = client::Client::Connect(options);
    status = connected.status();
    if (!status.ok()) return nullptr;
    return std::make_shared<const client::Client>(*std::move(connected));
  });
  if (client != nullptr) return client;
  clients_.pop_front();
  return status;
}

std::shared_ptr<Gateway::Slot> Gateway::SlotOf(const std::string& map) {
  const std::lock_guard lock(mutex_);
  return Touch(slots_, map, kMaxMaps, [] { return std::make_shared<Slot>(); });
}

absl::StatusOr<std::shared_ptr<const PlaceTiles>> Gateway::TilesOf(const client::Client& caller,
                                                                   const std::string& map) {
  ASSIGN_OR_RETURN(const auto info, caller.GetMapInfo(map));
  const auto slot = SlotOf(map);
  const std::lock_guard lock(slot->fetching);
  if (slot->tiles == nullptr || slot->tiles->content_id() != info.content_id) {
    ASSIGN_OR_RETURN(slot->tiles, Fetch(caller, map, info.content_id));
  }
  return slot->tiles;
}

}  // namespace scanloc::web
