#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/prior.hpp"
#include "scanloc/geo/geo_frame.hpp"
#include "scanloc/proto/messages.hpp"

namespace scanloc::server {

class UseCounter;

/// A map in service: never changed once made, and alive as long as a query holds it.
struct ServedMap {
  std::string path;       ///< of the file it was loaded from
  std::string signature;  ///< DescriptorSignature of its parameters
  MapInfo info;
  std::shared_ptr<const Localizer> localizer;
  std::shared_ptr<UseCounter> use;   ///< how it fares; null where that is not counted
  std::optional<geo::GeoFrame> geo;  ///< where the map knows where on earth it stands
};

/// The maps of a server by name. Thread-safe; readers hold a snapshot and are never kept waiting by
/// a map that is being made ready.
class MapRegistry {
 public:
  MapRegistry() = default;

  /// Each name is loading until Serve.
  explicit MapRegistry(const std::vector<std::string>& names);

  /// From then on the name is known, and loading until Serve. No effect on one that is known. Where
  /// maps are in service already, it does not count for the empty name until it is, too.
  void Add(const std::string& name);

  /// From then on the name is not known; queries under way end with the map they have. NotFound: it
  /// was not.
  absl::Status Remove(const std::string& name);

  /// Makes the map ready, O(n log n), then puts it in service under the name in place of the one
  /// before. Queries under way keep the one they began with. On error the one before stays.
  /// NotFound: no such name. InvalidArgument: the map's parameters are bad.
  absl::Status Serve(const std::string& name, const std::string& path, Map map,
                     std::shared_ptr<UseCounter> use = nullptr);

  /// Takes a map that was found damaged out of service: it counts as one that could not be loaded.
  /// False: it was not in service any more.
  bool Withdraw(const ServedMap& map);

  /// From then on asked what to say of a name that is not known, from any thread. Before the first
  /// Find.
  void OnUnknown(std::function<absl::Status(const std::string& name)> ask) {
    ask_unknown_ = std::move(ask);
  }

  /// From then on asked which maps lie wholly elsewhere than a disc on earth, from any thread.
  /// Before the first FindAll.
  using FindElsewhere =
      std::function<absl::StatusOr<std::set<std::string>>(const Prior::GeoDisc& disc)>;
  void OnPlaceOnEarth(FindElsewhere find) { find_elsewhere_ = std::move(find); }

  /// When a map in service was last found by its name; the clock's least where it never was.
  [[nodiscard]] std::chrono::steady_clock::time_point LastUsed(const std::string& name) const;

  /// Tells that the map's file could not be loaded. Has no effect on a map that is in service.
  void SetFailed(const std::string& name);

  /// The map that is in service under the name; empty stands for the only one there is, beside
  /// which others may have failed to load. NotFound that lists the names: there is none, or the
  /// name is empty and there are several. Unavailable: it is still loading, or could not be loaded.
  [[nodiscard]] absl::StatusOr<std::shared_ptr<const ServedMap>> Find(
      const std::string& name) const;

  /// The map of that name; empty stands for all that are in service, in order of name, those of one
  /// content once, without those known to lie elsewhere on earth. Errors as of Find; Unavailable,
  /// too, while one of them loads at the start. NotFound: all lie elsewhere.
  [[nodiscard]] absl::StatusOr<std::vector<std::shared_ptr<const ServedMap>>> FindAll(
      const std::string& name, const std::optional<Prior::GeoDisc>& on_earth = {}) const;

  /// Every map, in order of name.
  [[nodiscard]] std::vector<MapSummary> List() const;

 private:
  struct Slot {
    std::shared_ptr<const ServedMap> served;  // null while loading
    bool has_failed = false;
    bool is_late = false;  // was added when others were in service
    mutable std::chrono::steady_clock::time_point last_used =
        std::chrono::steady_clock::time_point::min();
  };
  using Slots = std::map<std::string, Slot>;

  // All with mutex_ held.
  [[nodiscard]] std::vector<Slots::const_iterator> Unnamed() const;  // that no name may stand for
  [[nodiscard]] static absl::StatusOr<std::shared_ptr<const ServedMap>> ServedIn(
      const Slots::value_type& slot);

  [[nodiscard]] std::string KnownNames() const;

  std::function<absl::Status(const std::string& name)> ask_unknown_;
  FindElsewhere find_elsewhere_;
  mutable std::mutex mutex_;
  Slots slots_;
  std::map<std::string, std::uint64_t> generations_;  // of removed ones, too
};

}  // namespace scanloc::server
