#pragma once

#include "admission/admission.hpp"
#include "ops/recent_answers.hpp"
#include "rpc/inbound_call.hpp"
#include "rpc/raw_service.hpp"
#include "scanloc/server/map_registry.hpp"

namespace scanloc::server {

/// scanloc.v1.Viewer: what people look at. Each call is answered where it arrives, from what is in
/// memory.
class ViewerService final : public RawService {
 public:
  /// All must outlive the service.
  ViewerService(const MapRegistry& maps, const RecentAnswers& answers, const CallWaits& waits,
                Admission& admission);

 private:
  template <typename Request, typename Act>
  void Offer(const char* path, const char* method, Role role, Act act);

  const MapRegistry& maps_;
  const RecentAnswers& answers_;
  const CallWaits waits_;
  Admission& admission_;
};

}  // namespace scanloc::server
