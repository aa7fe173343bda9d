#include <utility>

#include "client_options.hpp"
#include "client_state.hpp"
#include "scanloc/client/client.hpp"
#include "scanloc/core/status_macros.hpp"
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
        call_(*client_->stub, client_->options, options.request_id, options.map) {}
  ~ServedRobot() override { (void)Close(); }

  absl::Status Open() {
    v1::LocalizeStreamRequest request;
    v1::StreamConfig& config = *request.mutable_config();
    config.set_map(options_.map);
    *config.mutable_options() = proto::ToProto(options_.query, options_.budget);
    config.set_max_step_m(options_.max_step_m);
    v1::LocalizeStreamResponse response;
    if (auto status = call_.Ask(request, timeout_, &response); !status.ok()) {
      return client_->WithAddress(status);
    }
    return response.has_opened()
               ? absl::OkStatus()
               : client_->BadReply(absl::InternalError("a stream was not opened"));
  }

  absl::StatusOr<TrackedReply> Locate(PointView scan, const std::optional<Pose>& T_last_scan,
                                      const ScanHeader& header) override {
    RETURN_IF_ERROR(CheckScanSize(scan));
    auto reply = Ask(scan, T_last_scan, header);
    if (map_ == nullptr || proto::ReasonOf(reply.status()) != v1::ERROR_REASON_PARAMS_MISMATCH) {
      return reply;
    }
    // The map was replaced by one that wants other descriptors. The scan has been counted.
    ASSIGN_OR_RETURN(const auto terms, client_->TermsOf(options_.timeout, options_.request_id));
    ASSIGN_OR_RETURN(map_, client_->FetchMap(options_.map, terms));
    return Ask(scan, Pose::Identity(), header);
  }

  absl::Status Close() override { return client_->WithAddress(call_.Close(timeout_)); }

 private:
  [[nodiscard]] absl::StatusOr<TrackedReply> Ask(PointView scan,
                                                 const std::optional<Pose>& T_last_scan,
                                                 const ScanHeader& header) {
    v1::LocalizeStreamRequest request;
    v1::StreamScan& message = *request.mutable_scan();
    if (map_ == nullptr) {
      *message.mutable_scan() = proto::ToProto(scan, options_.mount);
    } else {
      ASSIGN_OR_RETURN(const auto descriptor, map_->Describe(scan, options_.mount));
      *message.mutable_descriptors() = proto::ToProto(descriptor);
    }
    // Who describes the scan here tells the server of the turned frame, and hears of it.
    const SensorMount turned_here = map_ != nullptr ? options_.mount : SensorMount();
    std::optional<Pose> T_last = T_last_scan;
    if (T_last) T_last = TurnedStep(turned_here, *T_last);
    proto::SetOdometry(T_last, &message);
    message.set_stamp_ns(header.stamp_ns);
    message.set_frame_id(header.frame_id);
    v1::LocalizeStreamResponse response;
    if (auto status = call_.Ask(request, timeout_, &response); !status.ok()) {
      return client_->WithAddress(status);
    }
    if (response.has_error()) {
      return client_->WithAddress(proto::FromErrorStatus(response.error()));
    }
    ASSIGN_OR_RETURN(auto reply, client_->Read(response.answer()));
    TellOfBase(turned_here, reply.reply.answer);
    return reply;
  }

  const std::shared_ptr<State> client_;
  const StreamOptions options_;
  const milliseconds timeout_;
  std::shared_ptr<CachedMap> map_;  // null where scans are sent as they are
  StreamCall call_;
};

absl::StatusOr<RobotStream> Client::OpenStream(const StreamOptions& options) const {
  ASSIGN_OR_RETURN(const auto terms, state_->TermsOf(options.timeout, options.request_id));
  std::shared_ptr<CachedMap> map;
  if (options.send_descriptor) {
    ASSIGN_OR_RETURN(map, state_->FetchMap(options.map, terms));
  }
  auto robot = std::make_unique<ServedRobot>(state_, options, std::move(map));
  RETURN_IF_ERROR(robot->Open());
  return RobotStream(std::move(robot));
}

}  // namespace scanloc::client
