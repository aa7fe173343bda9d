#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/proto/messages.hpp"

namespace scanloc::client {

/// A map's parameters as once fetched, and describers for them. Thread-safe.
class CachedMap {
 public:
  explicit CachedMap(const MapInfo& info);

  [[nodiscard]] const std::string& content_id() const { return content_id_; }
  [[nodiscard]] const std::string& signature() const { return signature_; }

  /// InvalidArgument: a mount out of range.
  [[nodiscard]] absl::StatusOr<SignedDescriptor> Describe(PointView scan, const SensorMount& mount);

 private:
  const std::string content_id_;
  const Params params_;
  const std::string signature_;
  std::mutex mutex_;
  std::vector<Describer> idle_;  // one for every thread that was ever here at the same time
};

/// The maps that were asked for, by the name that requests give. Thread-safe.
class MapCache {
 public:
  /// Null if it was not fetched yet or was forgotten.
  [[nodiscard]] std::shared_ptr<CachedMap> Find(const std::string& name) const;

  std::shared_ptr<CachedMap> Put(const std::string& name, const MapInfo& info);

  /// Forgets the map, unless another thread has put a newer one there already.
  void Forget(const std::string& name, const std::shared_ptr<CachedMap>& stale);

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<CachedMap>> maps_;
};

}  // namespace scanloc::client
