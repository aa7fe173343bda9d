#include "map_cache.hpp"

#include <optional>
#include <utility>

#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/as_received.hpp"

namespace scanloc::client {

CachedMap::CachedMap(const MapInfo& info)
    : content_id_(info.content_id),
      params_(info.params),
      signature_(DescriptorSignature(info.params)) {}

absl::StatusOr<SignedDescriptor> CachedMap::Describe(PointView scan, const SensorMount& mount) {
  RETURN_IF_ERROR(Validate(mount));
  PointCloud buffer;
  const PointView seen = Seen(proto::AsReceived(mount), scan, buffer);
  std::optional<Describer> describer;
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      describer = std::move(idle_.back());
      idle_.pop_back();
    }
  }
  if (!describer) {
    ASSIGN_OR_RETURN(describer, Describer::Create(params_));
  }
  SignedDescriptor result{.signature = signature_, .descriptor = describer->Describe(seen)};
  const std::lock_guard lock(mutex_);
  idle_.push_back(*std::move(describer));
  return result;
}

std::shared_ptr<CachedMap> MapCache::Find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = maps_.find(name);
  return found == maps_.end() ? nullptr : found->second;
}

std::shared_ptr<CachedMap> MapCache::Put(const std::string& name, const MapInfo& info) {
  auto map = std::make_shared<CachedMap>(info);
  const std::lock_guard lock(mutex_);
  maps_[name] = map;
  return map;
}

void MapCache::Forget(const std::string& name, const std::shared_ptr<CachedMap>& stale) {
  const std::lock_guard lock(mutex_);
  const auto found = maps_.find(name);
  if (found != maps_.end() && found->second == stale) maps_.erase(found);
}

}  // namespace scanloc::client
