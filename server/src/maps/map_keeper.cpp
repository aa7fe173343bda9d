#include "maps/map_keeper.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "front/memory.hpp"
#include "ops/clock.hpp"
#include "rpc/unary_call.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::server {
namespace {

constexpr int kNicest = 19;

void LetOthersGoFirst() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kNicest);  // of this thread
}

}  // namespace

std::string HealthName(const std::string& map_name) {
  return absl::StrCat("scanloc.map/", map_name);
}

std::string CheckedHealthName(const std::string& map_name) {
  return absl::StrCat(HealthName(map_name), "/checked");
}

MapKeeper::MapKeeper(MapSources sources, MapLoader load_map, MapRegistry& maps,
                     HealthService& health, Metrics& metrics, MemoryBound& memory, UseBook& uses)
    : sources_(std::move(sources)),
      load_map_(std::move(load_map)),
      maps_(maps),
      health_(health),
      metrics_(metrics),
      memory_(memory),
      uses_(uses),
      scrubber_({.progress =
                     [this](const ServedMap& map, std::size_t num_done) {
                       metrics_.SetChecked(map.info.name, num_done);
                     },
                 .done = [this](const std::shared_ptr<const ServedMap>& map,
                                const absl::Status& status) { NoteScrubbed(*map, status); }}) {}

void MapKeeper::Stop() {
  is_stopping_ = true;
  scrubber_.Stop();
}

void MapKeeper::NoteScrubbed(const ServedMap& map, const absl::Status& status) {
  if (absl::IsDataLoss(status)) return TakeOut(map, status);
  if (!status.ok()) {
    return spdlog::error("map {} is not checked to its end: {}", map.info.name,
                         absl::StrCat(status.message()));
  }
  spdlog::info("map {} is checked: all of its {} places are sound", map.info.name,
               map.info.num_places);
  const std::lock_guard lock(mutex_);
  const auto now = maps_.Find(map.info.name);
  if (now.ok() && now->get() == &map) health_.Set(CheckedHealthName(map.info.name), true);
}

void MapKeeper::TakeOut(const ServedMap& map, const absl::Status& why) {
  {
    const std::lock_guard lock(mutex_);
    if (!maps_.Withdraw(map)) return;
    health_.Set(HealthName(map.info.name), false);
    health_.Set(CheckedHealthName(map.info.name), false);
    TellHealth();
    metrics_.CountDamaged(map.info.name);
    spdlog::error("map {} taken out of service: {}", map.info.name, absl::StrCat(why.message()));
  }
  if (tell_damage_) tell_damage_(map.info.name);
}

absl::Status MapKeeper::ExpectAll() {
  health_.Set("", false);
  ASSIGN_OR_RETURN(const auto known, sources_.List());
  const std::lock_guard lock(mutex_);
  for (const MapSource& source : known) Expect(source.name);
  return absl::OkStatus();
}

std::mutex& MapKeeper::MutexOf(const std::string& name) {
  const std::lock_guard lock(mutex_);
  return map_mutexes_[name];
}

absl::Status MapKeeper::Load(const MapSource& source) {
  const std::lock_guard lock(MutexOf(source.name));
  return LoadNow(source);
}

absl::Status MapKeeper::LoadNow(const MapSource& source) {
  {
    const std::lock_guard lock(mutex_);
    Expect(source.name);
  }
  const std::int64_t start_ns = NowNs();
  std::error_code unknown;
  const std::uintmax_t size = std::filesystem::file_size(source.path, unknown);
  const MemoryBound::Loading loading(memory_, unknown ? 0 : static_cast<std::int64_t>(size));
  spdlog::debug("loading map {} from {}", source.name, source.path);
  absl::Status status = Guard([&]() -> absl::Status {
    const auto served = maps_.Find(source.name);
    ASSIGN_OR_RETURN(auto map,
                     load_map_(source.path, served.ok() ? &(*served)->localizer->map() : nullptr));
    return PutInService(source, std::move(map));
  });
  // What the loading or the map before held would stay, a little more of it after every reload.
  ReturnFreedMemory();
  if (status.ok()) {
    const std::lock_guard lock(mutex_);
    // A query, or the check of all places, may have found damage by now and taken it out again.
    health_.Set(HealthName(source.name), maps_.Find(source.name).ok());
    TellHealth();
  }
  metrics_.SetLoadTime(source.name, 1e-9 * static_cast<double>(NowNs() - start_ns));
  if (status.ok()) return status;
  metrics_.CountFailedLoad(source.name);
  maps_.SetFailed(source.name);
  return {status.code(), absl::StrCat("map ", source.name, ": ", status.message())};
}

bool MapKeeper::IsInService(const std::string& name, const Map& map) const {
  const auto served = maps_.Find(name);
  if (!served.ok()) return false;
  const Map& now = (*served)->localizer->map();
  return now.content_id == map.content_id && now.complete == map.complete &&
         now.calibration == map.calibration && now.confusable == map.confusable &&
         now.geo_origin == map.geo_origin;
}

absl::Status MapKeeper::PutInService(const MapSource& source, Map map) {
  if (IsInService(source.name, map)) {
    spdlog::info("map {} is unchanged", source.name);
    return absl::OkStatus();
  }
  // A map that answers is not given up for one that may be damaged.
  const bool is_checked = map.payload != nullptr && maps_.Find(source.name).ok();
  if (is_checked) {
    absl::Status status = map.payload->Scrub([this](std::size_t) { return !is_stopping_; });
    if (!status.ok()) return status;
  }
  const std::size_t num_places = map.places.size();
  const std::string content_id = map.content_id;
  const std::string calibration_id = map.calibration_id;
  const bool complete = map.complete;
  auto use = uses_.Open(source.path, content_id, static_cast<std::int64_t>(map.places.size()));
  RETURN_IF_ERROR(maps_.Serve(source.name, source.path, std::move(map), std::move(use)));
  spdlog::info("map {} in service: {} places, content id {}, calibration id {}", source.name,
               num_places, content_id, calibration_id.empty() ? "none" : calibration_id);
  const std::lock_guard lock(mutex_);
  if (const auto served = maps_.Find(source.name); served.ok()) {
    const bool is_whole = is_checked || (*served)->localizer->map().payload == nullptr;
    metrics_.SetChecked(source.name, is_whole ? num_places : 0);
    health_.Set(CheckedHealthName(source.name), is_whole);
    if (!is_whole) scrubber_.Add(*served);
  }
  if (!complete) {
    spdlog::warn("map {} is half built: finish it with scanloc build --resume, then reload",
                 source.name);
  }
  return absl::OkStatus();
}

absl::Status MapKeeper::LoadAll() {
  ASSIGN_OR_RETURN(const auto sources, sources_.List());
  absl::Status first_error;
  std::size_t num_loaded = 0;
  for (const MapSource& source : sources) {
    const absl::Status status = Load(source);
    if (is_stopping_) return absl::CancelledError("the server was stopped while loading maps");
    if (status.ok()) {
      ++num_loaded;
      continue;
    }
    if (first_error.ok()) first_error = status;
    // Alone, it is told by who called; among others it must not go unseen.
    if (sources.size() > 1) spdlog::error("{}", absl::StrCat(status.message()));
  }
  if (num_loaded == 0 && !first_error.ok()) return first_error;
  if (sources.empty() && !serves_without_maps_) {
    spdlog::warn("no map to serve; put NAME.scanloc into the maps folder, then send SIGHUP");
  }
  const std::lock_guard lock(mutex_);
  have_all_been_tried_ = true;
  TellHealth();
  return absl::OkStatus();
}

void MapKeeper::TellHealth() {
  const std::vector<MapSummary> known = maps_.List();
  const bool is_any_served = std::ranges::any_of(
      known, [](const MapSummary& map) { return map.state == MapState::kServing; });
  health_.Set("", have_all_been_tried_ && (is_any_served || serves_without_maps_));
}

void MapKeeper::ServeWithoutMaps() {
  const std::lock_guard lock(mutex_);
  serves_without_maps_ = true;
}

void MapKeeper::Expect(const std::string& name) {
  if (IsKnown(name)) return;
  maps_.Add(name);
  health_.Set(HealthName(name), false);
  health_.Set(CheckedHealthName(name), false);
  metrics_.StartCountingLoads(name);
}

bool MapKeeper::IsKnown(const std::string& name) const {
  const std::vector<MapSummary> known = maps_.List();
  return std::ranges::any_of(known, [&](const MapSummary& map) { return map.name == name; });
}

absl::Status MapKeeper::Reload(const std::string& name) {
  if (!IsKnown(name)) {
    return absl::NotFoundError(absl::StrCat("no map is named ", absl::Utf8SafeCHexEscape(name)));
  }
  ASSIGN_OR_RETURN(const auto source, sources_.Find(name));
  return Load(source);
}

absl::Status MapKeeper::LoadNew(const std::string& name) {
  const auto is_served = [&] { return !name.empty() && maps_.Find(name).ok(); };
  const auto exists = [&] {
    return absl::AlreadyExistsError(absl::StrCat("map ", name, " is in service; reload it"));
  };
  if (is_served()) return exists();
  ASSIGN_OR_RETURN(const auto source, sources_.Find(name));
  const std::lock_guard lock(MutexOf(name));
  return is_served() ? exists() : LoadNow(source);
}

absl::Status MapKeeper::Unload(const std::string& name) {
  if (!IsKnown(name)) return maps_.Remove(name);  // which says so
  const std::lock_guard lock(MutexOf(name));
  return Remove(name);
}

absl::Status MapKeeper::Remove(const std::string& name) {
  RETURN_IF_ERROR(maps_.Remove(name));
  const std::lock_guard lock(mutex_);
  health_.Set(HealthName(name), false);
  TellHealth();
  spdlog::info("map {} out of service", name);
  return absl::OkStatus();
}

void MapKeeper::ForgetFailedAndGone() {
  for (const MapSummary& map : maps_.List()) {
    if (map.state != MapState::kFailed || sources_.Find(map.name).ok()) continue;
    const std::unique_lock lock(MutexOf(map.name), std::try_to_lock);
    if (!lock.owns_lock()) continue;  // it is loaded just now
    if (auto status = Remove(map.name); !status.ok()) spdlog::error("{}", status.ToString());
  }
}

void MapKeeper::ReloadAll() {
  const auto sources = sources_.List();
  if (!sources.ok()) return spdlog::error("{}", absl::StrCat(sources.status().message()));
  ForgetFailedAndGone();
  for (const MapSource& source : *sources) {
    if (is_stopping_) return;
    const absl::Status status = Load(source);
    if (!status.ok()) spdlog::error("not reloaded: {}", absl::StrCat(status.message()));
  }
}

MapScrubber::MapScrubber(Callbacks callbacks) : callbacks_(std::move(callbacks)) {}

MapScrubber::~MapScrubber() { Stop(); }

void MapScrubber::Stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    has_news_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void MapScrubber::Add(std::shared_ptr<const ServedMap> map) {
  if (map->localizer->map().payload == nullptr) return;
  const std::lock_guard lock(mutex_);
  if (is_stopping_) return;
  waiting_.push_back(std::move(map));
  if (!thread_.joinable()) thread_ = std::thread([this] { Work(); });
  has_news_.notify_all();
}

void MapScrubber::Work() {
  LetOthersGoFirst();
  std::unique_lock lock(mutex_);
  while (true) {
    has_news_.wait(lock, [&] { return is_stopping_ || !waiting_.empty(); });
    if (is_stopping_) return;
    const std::shared_ptr<const ServedMap> map = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    const absl::Status status = map->localizer->map().payload->Scrub([&](std::size_t num_done) {
      callbacks_.progress(*map, num_done);
      const std::lock_guard stopping(mutex_);
      return !is_stopping_ && map.use_count() > 1;
    });
    if (!absl::IsCancelled(status)) callbacks_.done(map, status);
    lock.lock();
  }
}

}  // namespace scanloc::server
