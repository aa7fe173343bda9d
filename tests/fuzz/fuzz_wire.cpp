// What comes over the network or out of captured files: the first byte chooses the message, the
// rest is its bytes. Descriptors that are good are asked of a small map.
#include <cstddef>
#include <cstdint>
#include <string>

#include "scanloc/core/localizer.hpp"
#include "scanloc/core/tracker.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/status.hpp"
#include "support/small_map.hpp"

namespace {

using namespace scanloc;

template <typename Message>
bool Parses(const std::string& bytes, Message* message) {
  return message->ParseFromString(bytes);
}

void Ask(const v1::LocalizeRequest& request) {
  static const auto localizer = test::LocalizerOf(test::SmallMap(1, 3));
  (void)proto::CheckMapName(request.map());
  const auto options = proto::FromProto(request.options());
  PointCloud points;
  if (request.has_scan()) (void)proto::FromProto(request.scan(), &points);
  if (!request.has_descriptors()) return;
  const auto query = proto::FromProto(request.descriptors());
  if (!query.ok()) return;
  (void)localizer->Localize(query->descriptor, options.ok() ? *options : QueryOptions());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 7) {
    case 0:
      if (v1::LocalizeRequest message; Parses(bytes, &message)) Ask(message);
      break;
    case 1:
      if (v1::LocalizeStreamRequest message; Parses(bytes, &message)) {
        Ask(message.query());
        (void)proto::OdometryFromProto(message);
      }
      break;
    case 2:
      if (v1::LocalizeResponse message; Parses(bytes, &message)) (void)proto::FromProto(message);
      break;
    case 3:
      if (v1::LocalizeStreamResponse message; Parses(bytes, &message)) {
        (void)proto::FromProto(message);
      }
      break;
    case 4:
      if (v1::GetMapInfoResponse message; Parses(bytes, &message)) {
        (void)proto::FromProto(message.info());
      }
      if (v1::ListMapsResponse message; Parses(bytes, &message)) (void)proto::FromProto(message);
      break;
    case 5:
      (void)proto::ParseCapturedQuery(bytes);
      break;
    default:
      (void)proto::RetryAfter(
          proto::FromGrpc({grpc::StatusCode::RESOURCE_EXHAUSTED, "busy", bytes}));
  }
  return 0;
}
