#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "maps/fetch_failures.hpp"
#include "maps/map_cache_dir.hpp"
#include "maps/map_keeper.hpp"
#include "ops/metrics.hpp"
#include "scanloc/catalogue/catalogue.hpp"
#include "scanloc/catalogue/store.hpp"
#include "scanloc/core/prior.hpp"
#include "scanloc/server/map_registry.hpp"
#include "scanloc/server/server_options.hpp"

namespace scanloc::server {

/// Has a server answer for the regions of a catalogue that robots ask for: fetches their maps from
/// a store into a folder, puts them in service, replaces them as the catalogue says, takes out what
/// is withdrawn, and makes room by what was asked for longest ago.
///
/// One thread listens to the catalogue, one fetches. While the catalogue cannot be reached what it
/// said last holds; while the store cannot, what is in the folder. Thread-safe.
class CatalogueMaps {
 public:
  /// A version that was replaced, and whose successor cannot be had, is answered from for so long.
  static constexpr std::chrono::minutes kLongestStale{10};
  /// Between two looks at the catalogue where it does not say by itself that something changed.
  static constexpr std::chrono::seconds kPoll{2};

  /// Opens the folder, which it has for itself. The others must outlive it.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<CatalogueMaps>> Open(
      const CatalogueOptions& options, MapKeeper& keeper, MapRegistry& maps, Metrics& metrics);
  ~CatalogueMaps();

  /// Puts in service what is in the folder and in force, as the catalogue says, or said last. Then
  /// starts the threads.
  void Start();
  /// Ends the fetch at hand.
  void Stop();

  /// Somebody asks for a region that is not in service: fetches it. Unavailable: it will be there,
  /// or cannot be had, and why.
  /// NotFound: the catalogue has none of that name.
  [[nodiscard]] absl::Status Want(const std::string& region);

  /// Somebody asks all maps about a place on earth: the regions in force that lie wholly elsewhere.
  /// Those of which the catalogue does not say where on earth they are, are not among them.
  /// Unavailable: one that reaches the disc is not in service yet, and is fetched.
  [[nodiscard]] absl::StatusOr<std::set<std::string>> Elsewhere(const Prior::GeoDisc& disc);

  /// The map in service under a name was found damaged: it is fetched anew, if it is a region's.
  void Lost(const std::string& name);

 private:
  using Clock = std::chrono::steady_clock;
  using Versions = std::map<std::string, catalogue::Version>;  // by region

  struct Wanted {
    std::string region;
    bool is_asked_for = true;  // else for later: it gets no room that others have
  };

  CatalogueMaps(const CatalogueOptions& options, MapCacheDir folder,
                std::unique_ptr<catalogue::Catalogue> catalogue,
                std::unique_ptr<catalogue::Store> store, MapKeeper& keeper, MapRegistry& maps,
                Metrics& metrics);

  void Listen();
  void FetchAll();
  /// What the catalogue says now. Takes out what is no longer in force and asks for what is new.
  void Follow(const std::vector<catalogue::Version>& live);
  void TakeOutStale();
  /// Fetches the version if need be and puts it in service.
  [[nodiscard]] absl::Status Serve(const catalogue::Version& version, bool is_asked_for);
  [[nodiscard]] absl::Status Fetch(const catalogue::Version& version, bool is_asked_for);
  /// False: all that could go is in use.
  bool MakeRoom(std::int64_t num_bytes);
  void WantNeighboursOf(const catalogue::Version& version);
  void TakeOut(const std::string& region);

  [[nodiscard]] bool IsStopping() {
    const std::lock_guard lock(mutex_);
    return is_stopping_;
  }
  /// With mutex_ held.
  void Queue(const std::string& region, bool is_asked_for);

  const CatalogueOptions options_;
  MapCacheDir folder_;
  const std::unique_ptr<catalogue::Catalogue> catalogue_;  // of the listening thread
  const std::unique_ptr<catalogue::Store> store_;
  MapKeeper& keeper_;
  MapRegistry& maps_;
  Metrics& metrics_;

  std::mutex mutex_;  // guards all below
  std::condition_variable has_news_;
  bool is_stopping_ = false;
  Versions live_;                                         // as the catalogue said last
  Versions served_;                                       // in service
  std::map<std::string, Clock::time_point> replaced_at_;  // since when a served one is not in force
  FetchFailures failures_;
  std::deque<Wanted> wanted_;
  std::thread listener_;
  std::thread fetcher_;
};

}  // namespace scanloc::server
