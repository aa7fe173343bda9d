#include <utility>

#include "client_options.hpp"
#include "client_state.hpp"
#include "scanloc/client/client.hpp"
#include "stream_call.hpp"

namespace scanloc::client {

using std::chrono::milliseconds;

/// A robot whose scans a server weighs.
class Client::ServedRobot final : public RobotStream::Tracking {
 public:
  ServedRobot(std::shared_ptr<State> client, const StreamOptions& options,
              std::shared_ptr<CachedMap> map)
      : client_(std::move(client)),
        options_(options),
        timeout_(options.timeout.value_or(client_->options.timeout)),
        map_(std::move(map)),
        call_(*client_->stub, client_->options, options.request_id) {}
  ~ServedRobot() override { (void)Close(); }

  absl::StatusOr<TrackedReply> Locate(PointView scan,
                                      const std::optional<Pose>& T_last_scan) override {
    if (auto status = CheckScanSize(scan); !status.ok()) return status;
    auto request = RequestFor(scan);
    if (!request.ok()) return request.status();
    if (!std::exchange(has_begun_, true)) {
      request->mutable_query()->set_map(options_.map);
      *request->mutable_query()->mutable_options() =
          proto::ToProto(options_.query, options_.budget);
      request->set_max_step_m(options_.max_step_m);
    }
    proto::SetOdometry(T_last_scan, &*request);
    v1::LocalizeStreamResponse response;
    if (auto status = call_.Ask(*request, timeout_, &response); !status.ok()) {
      return client_->WithAddress(status);
    }
    auto reply = proto::FromProto(response);
    if (!reply.ok()) return client_->BadReply(reply.status());
    return reply;
  }

  absl::Status Close() override { return client_->WithAddress(call_.Close(timeout_)); }

 private:
  [[nodiscard]] absl::StatusOr<v1::LocalizeStreamRequest> RequestFor(PointView scan) const {
    v1::LocalizeStreamRequest request;
    v1::LocalizeRequest& query = *request.mutable_query();
    if (map_ == nullptr) {
      *query.mutable_scan() = proto::ToProto(scan);
      return request;
    }
    const auto descriptor = map_->Describe(scan);
    if (!descriptor.ok()) return descriptor.status();
    *query.mutable_descriptors() = proto::ToProto(*descriptor);
    return request;
  }

  const std::shared_ptr<State> client_;
  const StreamOptions options_;
  const milliseconds timeout_;
  const std::shared_ptr<CachedMap> map_;  // null where scans are sent as they are
  bool has_begun_ = false;
  StreamCall call_;
};

absl::StatusOr<RobotStream> Client::OpenStream(const StreamOptions& options) const {
  const auto terms = state_->TermsOf(options.timeout, options.request_id);
  if (!terms.ok()) return terms.status();
  std::shared_ptr<CachedMap> map;
  if (options.send_descriptor) {
    const auto info = state_->FetchInfo(options.map, *terms);
    if (!info.ok()) return info.status();
    map = state_->cache.Put(options.map, *info);
  }
  return RobotStream(std::make_unique<ServedRobot>(state_, options, std::move(map)));
}

}  // namespace scanloc::client
