// What comes over the network or out of captured files: the first byte chooses the message, the
// rest is its bytes. What is good is done as the server does it, with a small map: scans are
// described, queries answered, streams tracked.
#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "grpc/health/v1/health.pb.h"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/track/tracker.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/convert_viewer.hpp"
#include "scanloc/proto/status.hpp"
#include "scanloc/v1/admin.pb.h"
#include "support/small_map.hpp"

namespace {

using namespace scanloc;

template <typename Message>
bool Parses(const std::string& bytes, Message* message) {
  return message->ParseFromString(bytes);
}

const std::shared_ptr<const Localizer>& TheLocalizer() {
  static const auto localizer = test::LocalizerOf(test::SmallMap(1, 3));
  return localizer;
}

ScanDescriptor Describe(PointView scan) {
  static auto describer = Describer::Create(TheLocalizer()->map().params).value();
  return describer.Describe(scan);
}

/// The descriptors of a query of either kind.
template <typename Request>
absl::StatusOr<ScanDescriptor> DescriptorOf(const Request& request) {
  if (request.has_scan()) {
    PointCloud points;
    if (auto status = proto::FromProto(request.scan(), &points); !status.ok()) return status;
    return Describe(points);
  }
  auto query = proto::FromProto(request.descriptors());
  if (!query.ok()) return query.status();
  return std::move(query->descriptor);
}

void Ask(const v1::LocalizeRequest& request) {
  (void)proto::CheckAskedMap(request.map());
  const auto options = proto::FromProto(request.options());
  const auto query = DescriptorOf(request);
  if (query.ok()) (void)TheLocalizer()->Localize(*query, options.ok() ? *options : Query());
}

/// As `scanloc locate --replay` does.
void Replay(const CapturedQuery& captured) {
  const ScanDescriptor query =
      captured.descriptor ? captured.descriptor->descriptor : Describe(captured.scan);
  (void)TheLocalizer()->Localize(query, captured.query);
}

/// A robot's stream: requests one behind the other, each after its size in two bytes. The first
/// says how they are answered.
void Track(const std::string& bytes) {
  std::unique_ptr<Tracker> tracker;
  for (std::size_t at = 0; at + 2 <= bytes.size();) {
    const std::size_t size =
        static_cast<std::uint8_t>(bytes[at]) + 256U * static_cast<std::uint8_t>(bytes[at + 1]);
    v1::LocalizeStreamRequest request;
    if (!Parses(bytes.substr(at + 2, size), &request)) return;
    at += 2 + std::min(size, bytes.size() - at - 2);
    if (tracker == nullptr) {
      TrackerOptions options;
      if (const auto query = proto::FromProto(request.config().options()); query.ok()) {
        options.query = *query;
      }
      if (request.config().has_max_step_m()) options.max_step_m = request.config().max_step_m();
      auto created = Tracker::Create(TheLocalizer(), options);
      if (!created.ok()) return;
      tracker = std::make_unique<Tracker>(*std::move(created));
    }
    const auto odometry = proto::OdometryFromProto(request.scan());
    const auto query = DescriptorOf(request.scan());
    if (!odometry.ok() || !query.ok()) return;
    (void)tracker->Update(*query, *odometry);
  }
}

/// What a server lets people see.
void ReadWhatIsSeen(const std::string& bytes) {
  if (v1::GetPlaceResponse message; Parses(bytes, &message)) (void)proto::FromProto(message);
  if (v1::ListConfusablePairsResponse message; Parses(bytes, &message)) {
    (void)proto::FromProto(message);
  }
  if (v1::ListPlaceUseResponse message; Parses(bytes, &message)) (void)proto::FromProto(message);
  if (v1::ListAnswersResponse message; Parses(bytes, &message)) (void)proto::FromProto(message);
}

/// Requests that only name something.
void ReadNames(const std::string& bytes) {
  if (v1::ListMapsRequest message; Parses(bytes, &message)) (void)message.ByteSizeLong();
  if (v1::ListPlacesRequest message; Parses(bytes, &message)) {
    (void)PageOfPlaces(Map{}, message.page_size(), message.page_token());
  }
  if (v1::GetMapInfoRequest message; Parses(bytes, &message)) {
    (void)proto::CheckAskedMap(message.map());
  }
  if (v1::ReloadMapRequest message; Parses(bytes, &message)) {
    (void)proto::CheckAskedMap(message.map());
  }
  if (v1::LoadMapRequest message; Parses(bytes, &message)) {
    (void)proto::CheckAskedMap(message.map());
  }
  if (v1::UnloadMapRequest message; Parses(bytes, &message)) {
    (void)proto::CheckAskedMap(message.map());
  }
  if (grpc::health::v1::HealthCheckRequest message; Parses(bytes, &message)) {
    (void)proto::CheckAskedMap(message.service());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Else every name that is no UTF-8 is a line on stderr.
  static google::protobuf::LogHandler* const silenced = google::protobuf::SetLogHandler(nullptr);
  (void)silenced;
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 9) {
    case 0:
      if (v1::LocalizeRequest message; Parses(bytes, &message)) Ask(message);
      break;
    case 1:
      if (v1::LocalizeStreamRequest message; Parses(bytes, &message)) {
        (void)proto::FromProto(message.config().options());
        (void)DescriptorOf(message.scan());
        (void)proto::OdometryFromProto(message.scan());
      }
      break;
    case 2:
      if (v1::LocalizeResponse message; Parses(bytes, &message)) (void)proto::FromProto(message);
      break;
    case 3:
      if (v1::LocalizeStreamResponse message; Parses(bytes, &message)) {
        (void)proto::FromProto(message.answer());
        (void)proto::ReasonOf(proto::FromErrorStatus(message.error()));
      }
      break;
    case 4:
      if (v1::GetMapInfoResponse message; Parses(bytes, &message)) {
        (void)proto::FromProto(message.info());
      }
      if (v1::ListMapsResponse message; Parses(bytes, &message)) (void)proto::FromProto(message);
      if (v1::ListPlacesResponse message; Parses(bytes, &message)) (void)proto::FromProto(message);
      ReadWhatIsSeen(bytes);
      break;
    case 5:
      if (const auto captured = proto::ParseCapturedQuery(bytes); captured.ok()) Replay(*captured);
      break;
    case 7:
      Track(bytes);
      break;
    case 8:
      ReadNames(bytes);
      break;
    default:
      (void)proto::RetryAfter(
          proto::FromGrpc({grpc::StatusCode::RESOURCE_EXHAUSTED, "busy", bytes}));
  }
  return 0;
}
