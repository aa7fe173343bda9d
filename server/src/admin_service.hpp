#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "reception.hpp"
#include "scanloc/server/map_registry.hpp"
#include "scanloc/server/worker_pool.hpp"
#include "scanloc/v1/admin.grpc.pb.h"

namespace scanloc::server {

/// What an operator may do to the map of a name.
struct AdminActions {
  std::function<absl::Status(const std::string&)> reload;
  std::function<absl::Status(const std::string&)> load;
  std::function<absl::Status(const std::string&)> unload;
};

/// scanloc.v1.Admin. Runs on a thread of its own, so that a map that takes long to load keeps no
/// robot waiting.
class AdminService final
    : public v1::Admin::WithRawCallbackMethod_ReloadMap<v1::Admin::WithRawCallbackMethod_LoadMap<
          v1::Admin::WithRawCallbackMethod_UnloadMap<v1::Admin::Service>>> {
 public:
  /// Maps, reception and what the actions use must outlive the service.
  AdminService(const MapRegistry& maps, Reception& reception, AdminActions actions);

  /// Ends what is under way.
  void Finish() { worker_.Finish(); }

  grpc::ServerUnaryReactor* ReloadMap(grpc::CallbackServerContext* context,
                                      const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* LoadMap(grpc::CallbackServerContext* context,
                                    const grpc::ByteBuffer* request,
                                    grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* UnloadMap(grpc::CallbackServerContext* context,
                                      const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;

 private:
  using Action = std::function<absl::Status(const std::string&)>;

  template <typename Request, typename Response>
  grpc::ServerUnaryReactor* Run(grpc::CallbackServerContext* context,
                                const grpc::ByteBuffer* request, grpc::ByteBuffer* response,
                                const char* method, const Action& action);

  const MapRegistry& maps_;
  Reception& reception_;
  const AdminActions actions_;
  WorkerPool worker_;
};

}  // namespace scanloc::server
