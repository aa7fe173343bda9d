#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "raw_service.hpp"
#include "reception.hpp"
#include "scanloc/server/map_registry.hpp"
#include "scanloc/server/worker_pool.hpp"
#include "waiting_room.hpp"

namespace scanloc::server {

/// What an operator may do to the map of a name.
struct AdminActions {
  std::function<absl::Status(const std::string&)> reload;
  std::function<absl::Status(const std::string&)> load;
  std::function<absl::Status(const std::string&)> unload;
};

/// scanloc.v1.Admin. Runs on a thread of its own, so that a map that takes long to load keeps no
/// robot waiting.
class AdminService final : public RawService {
 public:
  /// Maps, inbox, reception and what the actions use must outlive the service. Nothing of a request
  /// is received before its token is known to be an administrator's; then it waits in the inbox.
  AdminService(const MapRegistry& maps, WaitingRoom& inbox, Reception& reception,
               AdminActions actions);

  /// Ends what is under way.
  void Finish() { worker_.Finish(); }

 private:
  using Action = std::function<absl::Status(const std::string&)>;

  template <typename Request, typename Response>
  void Offer(const char* path, const char* method, const Action& action);

  const MapRegistry& maps_;
  WaitingRoom& inbox_;
  Reception& reception_;
  const AdminActions actions_;
  WorkerPool worker_;
};

}  // namespace scanloc::server
