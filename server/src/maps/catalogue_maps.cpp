#include "maps/catalogue_maps.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::server {
namespace {

/// What was asked for since is in use: it does not go to make room.
constexpr std::chrono::seconds kInUse{5};
constexpr std::chrono::seconds kLeastPause{1};
constexpr std::chrono::seconds kLongestPause = FetchFailures::kRetryFailed;
/// Regions so near to each other are neighbours.
constexpr double kNear_m = 300.0;

std::string Message(const absl::Status& status) { return absl::StrCat(status.message()); }

}  // namespace

absl::StatusOr<std::unique_ptr<CatalogueMaps>> CatalogueMaps::Open(const CatalogueOptions& options,
                                                                   MapKeeper& keeper,
                                                                   MapRegistry& maps,
                                                                   Metrics& metrics) {
  ASSIGN_OR_RETURN(auto opened, catalogue::OpenCatalogue(options.catalogue));
  ASSIGN_OR_RETURN(auto store, catalogue::OpenStore(options.store));
  ASSIGN_OR_RETURN(auto folder, MapCacheDir::Open(options.cache_dir));
  return std::unique_ptr<CatalogueMaps>(new CatalogueMaps(
      options, std::move(folder), std::move(opened), std::move(store), keeper, maps, metrics));
}

CatalogueMaps::CatalogueMaps(const CatalogueOptions& options, MapCacheDir folder,
                             std::unique_ptr<catalogue::Catalogue> catalogue,
                             std::unique_ptr<catalogue::Store> store, MapKeeper& keeper,
                             MapRegistry& maps, Metrics& metrics)
    : options_(options),
      folder_(std::move(folder)),
      catalogue_(std::move(catalogue)),
      store_(std::move(store)),
      keeper_(keeper),
      maps_(maps),
      metrics_(metrics) {}

CatalogueMaps::~CatalogueMaps() { Stop(); }

void CatalogueMaps::Start() {
  absl::StatusOr<std::vector<catalogue::Version>> live = catalogue_->Live();
  if (!live.ok()) {
    spdlog::error("the catalogue cannot be read, what it said last holds: {}",
                  Message(live.status()));
    live = folder_.RecallLive();
  } else if (absl::Status status = folder_.RememberLive(*live); !status.ok()) {
    spdlog::error("what the catalogue says cannot be remembered: {}", Message(status));
  }
  if (live.ok()) {
    for (const catalogue::Version& version : *live) {
      const std::lock_guard lock(mutex_);
      live_[version.region] = version;
    }
    folder_.RemoveAllBut(*live);
    for (const catalogue::Version& version : *live) {
      if (IsStopping()) return;
      if (!folder_.Has(version)) continue;
      if (absl::Status status = Serve(version, false); !status.ok()) {
        spdlog::error("region {}: {}", version.region, Message(status));
      }
    }
  }
  const std::lock_guard lock(mutex_);
  if (is_stopping_) return;
  listener_ = std::thread([this] { Listen(); });
  fetcher_ = std::thread([this] { FetchAll(); });
}

void CatalogueMaps::Stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    has_news_.notify_all();
  }
  if (listener_.joinable()) listener_.join();
  if (fetcher_.joinable()) fetcher_.join();
}

void CatalogueMaps::Queue(const std::string& region, bool is_asked_for) {
  const auto same = std::ranges::find(wanted_, region, &Wanted::region);
  if (same != wanted_.end() && (same->is_asked_for || !is_asked_for)) return;
  if (same != wanted_.end()) wanted_.erase(same);
  is_asked_for ? wanted_.push_front({region, true}) : wanted_.push_back({region, false});
  has_news_.notify_all();
}

absl::StatusOr<std::set<std::string>> CatalogueMaps::Elsewhere(const Prior::GeoDisc& disc) {
  const catalogue::Area middle{.corners = {{disc.longitude_deg, disc.latitude_deg}},
                               .is_on_earth = true};
  std::set<std::string> elsewhere;
  absl::Status status;
  const std::lock_guard lock(mutex_);
  for (const auto& [region, version] : live_) {
    if (!version.area.is_on_earth) continue;
    if (catalogue::Distance_m(middle, version.area) > disc.radius_m) {
      elsewhere.insert(region);
    } else if (!served_.contains(region)) {
      Queue(region, true);
      status = failures_.WhyNotServed(version);
    }
  }
  if (!status.ok()) return status;
  return elsewhere;
}

absl::Status CatalogueMaps::Want(const std::string& region) {
  const std::lock_guard lock(mutex_);
  const auto live = live_.find(region);
  if (live == live_.end()) {
    return absl::NotFoundError(absl::StrCat("the catalogue has no map of the region \"",
                                            absl::Utf8SafeCHexEscape(region), "\" in force"));
  }
  Queue(region, true);
  return failures_.WhyNotServed(live->second);
}

void CatalogueMaps::Listen() {
  bool was_reachable = true;
  while (!IsStopping()) {
    absl::Status status;
    absl::StatusOr<std::vector<catalogue::Version>> live = catalogue_->Live();
    status = live.status();
    if (live.ok()) Follow(*live);
    if (status.ok()) status = catalogue_->AwaitChange(kPoll);
    if (std::exchange(was_reachable, status.ok()) != status.ok()) {
      status.ok() ? spdlog::info("the catalogue can be read again")
                  : spdlog::error("the catalogue cannot be read, what it said last holds: {}",
                                  Message(status));
      metrics_.SetFileUnusable("catalogue", !status.ok());
    }
    TakeOutStale();
    if (status.ok()) continue;
    std::unique_lock lock(mutex_);
    has_news_.wait_for(lock, kPoll, [&] { return is_stopping_; });
  }
}

void CatalogueMaps::Follow(const std::vector<catalogue::Version>& live) {
  Versions now;
  for (const catalogue::Version& version : live) now[version.region] = version;
  std::vector<std::string> withdrawn;
  {
    const std::lock_guard lock(mutex_);
    if (now == live_) return;
    live_ = now;
    failures_.Clear();  // what is published anew is tried anew
    for (const auto& [region, version] : served_) {
      const auto in_force = now.find(region);
      if (in_force == now.end()) {
        withdrawn.push_back(region);
      } else if (in_force->second.FileName() != version.FileName()) {
        replaced_at_.try_emplace(region, Clock::now());
        Queue(region, true);
      } else {
        replaced_at_.erase(region);
      }
    }
  }
  for (const std::string& region : withdrawn) TakeOut(region);
  if (absl::Status status = folder_.RememberLive(live); !status.ok()) {
    spdlog::error("what the catalogue says cannot be remembered: {}", Message(status));
  }
}

void CatalogueMaps::TakeOutStale() {
  std::vector<std::string> stale;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [region, since] : replaced_at_) {
      if (Clock::now() - since > kLongestStale) stale.push_back(region);
    }
  }
  for (const std::string& region : stale) {
    spdlog::error(
        "region {}: its new map cannot be had, and the one before was replaced too long ago",
        region);
    TakeOut(region);
  }
}

void CatalogueMaps::TakeOut(const std::string& region) {
  std::optional<catalogue::Version> version;
  {
    const std::lock_guard lock(mutex_);
    const auto served = served_.find(region);
    if (served == served_.end()) return;
    version = served->second;
    served_.erase(served);
    replaced_at_.erase(region);
  }
  if (absl::Status status = keeper_.Unload(region); !status.ok()) {
    spdlog::error("region {}: {}", region, Message(status));
  }
  folder_.Remove(*version);  // whoever reads from it still has it open
}

void CatalogueMaps::Lost(const std::string& name) {
  TakeOut(name);
  const std::lock_guard lock(mutex_);
  if (live_.contains(name)) Queue(name, true);
}

void CatalogueMaps::FetchAll() {
  std::chrono::seconds pause = kLeastPause;
  while (true) {
    std::optional<catalogue::Version> version;
    bool is_asked_for = false;
    {
      std::unique_lock lock(mutex_);
      has_news_.wait(lock, [&] { return is_stopping_ || !wanted_.empty(); });
      if (is_stopping_) return;
      is_asked_for = wanted_.front().is_asked_for;
      const auto live = live_.find(wanted_.front().region);
      wanted_.pop_front();
      if (live == live_.end()) continue;
      const auto served = served_.find(live->first);
      if (served != served_.end() && served->second.FileName() == live->second.FileName()) continue;
      version = live->second;
    }
    const absl::Status status = Serve(*version, is_asked_for);
    {
      const std::lock_guard lock(mutex_);
      failures_.Note(*version, status);
    }
    if (status.ok()) {
      pause = kLeastPause;
      if (is_asked_for) WantNeighboursOf(*version);
      continue;
    }
    if (absl::IsCancelled(status) || !is_asked_for) continue;
    metrics_.CountFailedLoad(version->region);
    spdlog::error("region {} is not fetched: {}", version->region, Message(status));
    std::unique_lock lock(mutex_);
    // Others first; this one again after a while.
    const bool is_alone = wanted_.empty();
    if (live_.contains(version->region)) wanted_.push_back({version->region, true});
    if (is_alone) has_news_.wait_for(lock, pause, [&] { return is_stopping_; });
    pause = std::min(2 * pause, kLongestPause);
  }
}

absl::Status CatalogueMaps::Serve(const catalogue::Version& version, bool is_asked_for) {
  if (!folder_.Has(version)) {
    RETURN_IF_ERROR(Fetch(version, is_asked_for));
  }
  if (absl::Status status = keeper_.LoadFile({version.region, folder_.PathOf(version)});
      !status.ok()) {
    folder_.Remove(version);
    const std::lock_guard lock(mutex_);
    // Asked for again it is fetched anew.
    if (!served_.contains(version.region)) (void)keeper_.Unload(version.region);
    return status;
  }
  std::optional<catalogue::Version> before;
  bool is_withdrawn = false;
  {
    const std::lock_guard lock(mutex_);
    if (const auto served = served_.find(version.region); served != served_.end()) {
      before = served->second;
    }
    served_[version.region] = version;
    replaced_at_.erase(version.region);
    const auto live = live_.find(version.region);
    is_withdrawn = live == live_.end();
    if (!is_withdrawn && live->second.FileName() != version.FileName()) {
      replaced_at_[version.region] = Clock::now();
      Queue(version.region, true);
    }
  }
  if (before && before->FileName() != version.FileName()) folder_.Remove(*before);
  if (is_withdrawn) TakeOut(version.region);  // while it was loaded
  return absl::OkStatus();
}

absl::Status CatalogueMaps::Fetch(const catalogue::Version& version, bool is_asked_for) {
  if (version.num_bytes > options_.cache_bytes) {
    return absl::FailedPreconditionError(absl::StrCat(
        "its map has ", version.num_bytes, " bytes, more than the whole cache folder may take (",
        options_.cache_bytes, "); raise --cache-bytes"));
  }
  const std::int64_t room = options_.cache_bytes - folder_.NumBytes();
  if (room < version.num_bytes && (!is_asked_for || !MakeRoom(version.num_bytes))) {
    return absl::ResourceExhaustedError(
        absl::StrCat("its map has ", version.num_bytes,
                     " bytes, for which there is no room in the ", options_.cache_bytes,
                     " of the cache folder while the others are in use; raise --cache-bytes"));
  }
  const auto get = [&] {
    return store_->Get(version.FileName(), folder_.PartOf(version), version.num_bytes,
                       [this] { return !IsStopping(); });
  };
  absl::Status status = get();
  // The disk may be smaller than what is allowed of it.
  if (absl::IsResourceExhausted(status) && is_asked_for && MakeRoom(options_.cache_bytes)) {
    status = get();
  }
  return folder_.Keep(version, status);
}

bool CatalogueMaps::MakeRoom(std::int64_t num_bytes) {
  bool is_any_gone = false;
  while (options_.cache_bytes - folder_.NumBytes() < num_bytes) {
    std::optional<std::string> oldest;
    Clock::time_point last_used = Clock::now() - kInUse;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& [region, version] : served_) {
        const auto used = maps_.LastUsed(region);
        if (used < last_used) {
          oldest = region;
          last_used = used;
        }
      }
    }
    if (!oldest) break;
    spdlog::info("map {} makes room for others", *oldest);
    TakeOut(*oldest);
    is_any_gone = true;
  }
  return is_any_gone && (num_bytes >= options_.cache_bytes ||
                         options_.cache_bytes - folder_.NumBytes() >= num_bytes);
}

void CatalogueMaps::WantNeighboursOf(const catalogue::Version& version) {
  const std::lock_guard lock(mutex_);
  for (const auto& [region, other] : live_) {
    if (region != version.region && !served_.contains(region) &&
        catalogue::Distance_m(other.area, version.area) <= kNear_m) {
      Queue(region, false);
    }
  }
}

}  // namespace scanloc::server
