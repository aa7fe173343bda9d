#include "scanloc/server/map_registry.hpp"

#include <algorithm>
#include <cstddef>
#include <span>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/jobs/jobs.hpp"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

constexpr int kMaxNamesTold = 20;
/// A query holds its worker for as long as all of them take.
constexpr std::size_t kMaxMapsAtOnce = 32;

}  // namespace

MapRegistry::MapRegistry(const std::vector<std::string>& names) {
  for (const std::string& name : names) slots_[name];
}

void MapRegistry::Add(const std::string& name) {
  const std::lock_guard lock(mutex_);
  const bool is_late =
      std::ranges::any_of(slots_, [](const auto& slot) { return slot.second.served != nullptr; });
  slots_.try_emplace(name, Slot{.served = nullptr, .has_failed = false, .is_late = is_late});
}

absl::Status MapRegistry::Remove(const std::string& name) {
  std::shared_ptr<const ServedMap> before;  // freed outside the lock, if this was its last holder
  const std::lock_guard lock(mutex_);
  const auto slot = slots_.find(name);
  if (slot == slots_.end()) return absl::NotFoundError(absl::StrCat("no map is named ", name));
  before = std::move(slot->second.served);
  slots_.erase(slot);
  return absl::OkStatus();
}

absl::Status MapRegistry::Serve(const std::string& name, const std::string& path, Map map,
                                std::shared_ptr<UseCounter> use) {
  const auto unknown = [&] {
    return absl::NotFoundError(absl::StrCat("no map is configured as ", name));
  };
  // Nobody waits for a map that takes the place of another: its trees leave the processors to those
  // who ask that one, and those that would be the same are taken from it.
  std::size_t num_threads = 1;
  std::shared_ptr<const ServedMap> before;  // freed outside the lock, if this was its last holder
  {
    const std::lock_guard lock(mutex_);
    const auto slot = slots_.find(name);
    if (slot == slots_.end()) return unknown();
    before = slot->second.served;
    if (before == nullptr) num_threads = NumThreads(0);
  }
  auto next = std::make_shared<ServedMap>();
  next->path = path;
  next->use = std::move(use);
  next->signature = DescriptorSignature(map.params);
  next->info = InfoOf(name, map);
  if (map.geo_origin) {
    ASSIGN_OR_RETURN(next->geo, geo::GeoFrame::Create(*map.geo_origin));
  }
  auto localizer = Localizer::Create(
      std::make_shared<const Map>(std::move(map)),
      [&](std::span<const std::function<void()>> tasks) { return RunTasks(num_threads, tasks); },
      before == nullptr ? nullptr : before->localizer.get());
  if (!localizer.ok()) return localizer.status();
  next->localizer = *std::move(localizer);

  const std::lock_guard lock(mutex_);
  const auto slot = slots_.find(name);
  if (slot == slots_.end()) return unknown();  // removed meanwhile
  next->info.generation = ++generations_[name];
  before = std::exchange(slot->second.served, std::move(next));
  slot->second.has_failed = false;
  return absl::OkStatus();
}

bool MapRegistry::Withdraw(const ServedMap& map) {
  std::shared_ptr<const ServedMap> before;  // freed outside the lock, if this was its last holder
  const std::lock_guard lock(mutex_);
  const auto slot = slots_.find(map.info.name);
  if (slot == slots_.end() || slot->second.served.get() != &map) return false;
  before = std::move(slot->second.served);
  slot->second.has_failed = true;
  return true;
}

void MapRegistry::SetFailed(const std::string& name) {
  const std::lock_guard lock(mutex_);
  const auto slot = slots_.find(name);
  if (slot != slots_.end() && slot->second.served == nullptr) slot->second.has_failed = true;
}

std::vector<MapRegistry::Slots::const_iterator> MapRegistry::Unnamed() const {
  std::vector<Slots::const_iterator> unnamed;
  for (auto slot = slots_.begin(); slot != slots_.end(); ++slot) {
    const bool counts =
        slot->second.served != nullptr || (!slot->second.has_failed && !slot->second.is_late);
    if (counts || slots_.size() == 1) unnamed.push_back(slot);
  }
  return unnamed;
}

absl::StatusOr<std::shared_ptr<const ServedMap>> MapRegistry::ServedIn(
    const Slots::value_type& slot) {
  const auto& [name, state] = slot;
  if (state.served != nullptr) {
    state.last_used = std::chrono::steady_clock::now();
    return state.served;
  }
  return state.has_failed
             ? proto::WithReason(
                   v1::ERROR_REASON_MAP_FAILED,
                   absl::UnavailableError(absl::StrCat(
                       "map ", name, " could not be loaded; the server's log says why")))
             : proto::WithReason(v1::ERROR_REASON_MAP_LOADING,
                                 absl::UnavailableError(absl::StrCat(
                                     "map ", name, " is still loading; try again later")));
}

absl::StatusOr<std::shared_ptr<const ServedMap>> MapRegistry::Find(const std::string& name) const {
  std::unique_lock lock(mutex_);
  auto slot = slots_.find(name);
  if (name.empty()) {
    const std::vector<Slots::const_iterator> unnamed = Unnamed();
    slot = unnamed.size() == 1 ? unnamed.front() : slots_.end();
  }
  if (slot != slots_.end()) return ServedIn(*slot);
  if (!name.empty() && ask_unknown_) {
    lock.unlock();
    return ask_unknown_(name);
  }
  if (slots_.empty()) return absl::NotFoundError("this server has no map");
  const std::string what =
      name.empty() ? "the request names no map and this server has several"
                   : absl::StrCat("no map is named \"", absl::Utf8SafeCHexEscape(name), "\"");
  return absl::NotFoundError(absl::StrCat(what, "; it has ", KnownNames()));
}

absl::StatusOr<std::vector<std::shared_ptr<const ServedMap>>> MapRegistry::FindAll(
    const std::string& name, const std::optional<Prior::GeoDisc>& on_earth) const {
  std::vector<std::shared_ptr<const ServedMap>> found;
  if (name.empty()) {
    std::set<std::string> elsewhere;
    if (on_earth && find_elsewhere_) {
      ASSIGN_OR_RETURN(elsewhere, find_elsewhere_(*on_earth));
    }
    std::set<std::string> contents;
    const std::lock_guard lock(mutex_);
    for (const Slots::const_iterator slot : Unnamed()) {
      if (elsewhere.contains(slot->first)) continue;
      ASSIGN_OR_RETURN(auto map, ServedIn(*slot));
      if (contents.insert(map->info.content_id).second) found.push_back(std::move(map));
    }
    if (found.size() > kMaxMapsAtOnce) {
      return absl::NotFoundError(absl::StrCat("the request names no map and this server has ",
                                              found.size(), "; at most ", kMaxMapsAtOnce,
                                              " are asked at once: name one"));
    }
  }
  if (!found.empty()) return found;
  if (name.empty() && on_earth && find_elsewhere_) {
    return absl::NotFoundError(absl::StrCat("no map lies within ", on_earth->radius_m,
                                            " m of latitude ", on_earth->latitude_deg,
                                            ", longitude ", on_earth->longitude_deg));
  }
  ASSIGN_OR_RETURN(auto only, Find(name));
  found.push_back(std::move(only));
  return found;
}

std::chrono::steady_clock::time_point MapRegistry::LastUsed(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto slot = slots_.find(name);
  return slot == slots_.end() ? std::chrono::steady_clock::time_point::min()
                              : slot->second.last_used;
}

std::vector<MapSummary> MapRegistry::List() const {
  std::vector<MapSummary> maps;
  const std::lock_guard lock(mutex_);
  for (const auto& [name, slot] : slots_) {
    MapSummary summary{.name = name,
                       .state = slot.has_failed ? MapState::kFailed : MapState::kLoading,
                       .content_id = {},
                       .num_places = 0,
                       .generation = 0};
    if (slot.served != nullptr) {
      summary.state = MapState::kServing;
      summary.content_id = slot.served->info.content_id;
      summary.num_places = slot.served->info.num_places;
      summary.generation = slot.served->info.generation;
    }
    maps.push_back(std::move(summary));
  }
  return maps;
}

std::string MapRegistry::KnownNames() const {
  std::string names;
  int num_told = 0;
  for (const auto& [name, slot] : slots_) {
    if (num_told == kMaxNamesTold) {
      absl::StrAppend(&names, " and ", slots_.size() - kMaxNamesTold, " more");
      break;
    }
    absl::StrAppend(&names, num_told++ == 0 ? "" : ", ", name);
  }
  return names;
}

}  // namespace scanloc::server
