#include <utility>

#include "client_options.hpp"
#include "client_state.hpp"
#include "scanloc/client/client.hpp"
#include "stream_call.hpp"

namespace scanloc::client {

using std::chrono::milliseconds;

struct RobotStream::State {
  State(std::shared_ptr<Client::State> client_state, const StreamOptions& stream_options,
        milliseconds scan_timeout)
      : client(std::move(client_state)),
        options(stream_options),
        timeout(scan_timeout),
        call(*client->stub, client->options, stream_options.request_id) {}

  [[nodiscard]] absl::StatusOr<v1::LocalizeStreamRequest> RequestFor(PointView scan) const {
    v1::LocalizeStreamRequest request;
    v1::LocalizeRequest& query = *request.mutable_query();
    if (map == nullptr) {
      *query.mutable_scan() = proto::ToProto(scan);
      return request;
    }
    const auto descriptor = map->Describe(scan);
    if (!descriptor.ok()) return descriptor.status();
    *query.mutable_descriptors() = proto::ToProto(*descriptor);
    return request;
  }

  const std::shared_ptr<Client::State> client;
  const StreamOptions options;
  const milliseconds timeout;
  std::shared_ptr<CachedMap> map;  // null where scans are sent as they are
  bool has_begun = false;
  StreamCall call;
};

RobotStream::RobotStream(std::unique_ptr<State> state) : state_(std::move(state)) {}
RobotStream::RobotStream(RobotStream&&) noexcept = default;
RobotStream& RobotStream::operator=(RobotStream&&) noexcept = default;
RobotStream::~RobotStream() {
  if (state_ != nullptr) (void)Close();
}

absl::StatusOr<RobotStream> Client::OpenStream(const StreamOptions& options) const {
  const auto terms = state_->TermsOf(options.timeout, options.request_id);
  if (!terms.ok()) return terms.status();
  auto stream = std::make_unique<RobotStream::State>(
      state_, options, options.timeout.value_or(state_->options.timeout));
  if (options.send_descriptor) {
    const auto info = state_->FetchInfo(options.map, *terms);
    if (!info.ok()) return info.status();
    stream->map = state_->cache.Put(options.map, *info);
  }
  return RobotStream(std::move(stream));
}

absl::StatusOr<TrackedReply> RobotStream::Locate(PointView scan,
                                                 const std::optional<Pose>& T_last_scan) {
  if (auto status = CheckScanSize(scan); !status.ok()) return status;
  auto request = state_->RequestFor(scan);
  if (!request.ok()) return request.status();
  if (!std::exchange(state_->has_begun, true)) {
    request->mutable_query()->set_map(state_->options.map);
    *request->mutable_query()->mutable_options() =
        proto::ToProto(state_->options.query, state_->options.budget);
    request->set_max_step_m(state_->options.max_step_m);
  }
  proto::SetOdometry(T_last_scan, &*request);
  v1::LocalizeStreamResponse response;
  if (auto status = state_->call.Ask(*request, state_->timeout, &response); !status.ok()) {
    return state_->client->WithAddress(status);
  }
  auto reply = proto::FromProto(response);
  if (!reply.ok()) return state_->client->BadReply(reply.status());
  return reply;
}

absl::Status RobotStream::Close() {
  return state_->client->WithAddress(state_->call.Close(state_->timeout));
}

}  // namespace scanloc::client
