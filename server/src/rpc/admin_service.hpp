#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "admission/admission.hpp"
#include "rpc/inbound_call.hpp"
#include "rpc/raw_service.hpp"
#include "scanloc/server/map_registry.hpp"
#include "scanloc/server/worker_pool.hpp"

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
  /// Maps, waits, admission and what the actions use must outlive the service. Nothing of a request
  /// is received before its token is known to be an administrator's.
  AdminService(const MapRegistry& maps, const CallWaits& waits, Admission& admission,
               AdminActions actions);

  /// Ends what is under way.
  void Finish() { worker_.Finish(); }

 private:
  using Action = std::function<absl::Status(const std::string&)>;

  template <typename Request, typename Response>
  void Offer(const char* path, const char* method, const Action& action);

  const MapRegistry& maps_;
  const CallWaits waits_;
  Admission& admission_;
  const AdminActions actions_;
  WorkerPool worker_;
};

}  // namespace scanloc::server
