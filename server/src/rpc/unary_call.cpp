#include "rpc/unary_call.hpp"

#include <arpa/inet.h>
#include <grpc/support/time.h>
#include <grpcpp/support/proto_buffer_reader.h>
#include <grpcpp/support/proto_buffer_writer.h>

#include <algorithm>
#include <cstdint>

#include "absl/strings/strip.h"

namespace scanloc::server {
namespace {

/// Largest request that holds neither scan nor descriptors [bytes].
constexpr std::size_t kMaxSmallRequestBytes = 4096;

}  // namespace

absl::Status CheckStillWanted(const grpc::CallbackServerContext& context) {
  if (context.IsCancelled()) return absl::CancelledError("the caller has hung up");
  // Not as a time point: beyond the year 2262 that overflows, and is long past.
  const gpr_timespec deadline = context.raw_deadline();
  if (gpr_time_cmp(deadline, gpr_now(deadline.clock_type)) <= 0) {
    return absl::DeadlineExceededError("the deadline passed before the query could start");
  }
  return absl::OkStatus();
}

absl::Status CheckSmall(const grpc::ByteBuffer& request) {
  if (!request.Valid() || request.Length() <= kMaxSmallRequestBytes) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("the request has ", request.Length(),
                                                 " bytes; at most ", kMaxSmallRequestBytes,
                                                 " are allowed here"));
}

std::string AddressOf(const grpc::CallbackServerContext& context) {
  return AddressOfPeer(context.peer());
}

std::string AddressOfPeer(const std::string& peer) {
  const std::string address = peer.substr(0, peer.rfind(':'));
  // "ipv6:%5B2001:db8::1%25eth0%5D", as a URI has it; or with plain brackets.
  absl::string_view host = address;
  if (!absl::ConsumePrefix(&host, "ipv6:")) return address;
  if (!absl::ConsumePrefix(&host, "%5B")) absl::ConsumePrefix(&host, "[");
  if (!absl::ConsumeSuffix(&host, "%5D")) absl::ConsumeSuffix(&host, "]");
  host = host.substr(0, host.find('%'));
  in6_addr bytes = {};
  if (inet_pton(AF_INET6, std::string(host).c_str(), &bytes) != 1) return address;
  char text[INET6_ADDRSTRLEN] = {};
  if (IN6_IS_ADDR_V4MAPPED(&bytes)) {
    inet_ntop(AF_INET, &bytes.s6_addr[12], text, sizeof text);
    return absl::StrCat("ipv4:", text);
  }
  std::fill(&bytes.s6_addr[8], &bytes.s6_addr[16], std::uint8_t{0});
  inet_ntop(AF_INET6, &bytes, text, sizeof text);
  return absl::StrCat("ipv6:", text, "/64");
}

absl::Status Parse(const grpc::ByteBuffer& bytes, google::protobuf::Message* message) {
  if (bytes.Valid()) {
    grpc::ByteBuffer shared = bytes;  // the reader takes no constant one
    grpc::ProtoBufferReader reader(&shared);
    if (reader.status().ok() && message->ParseFromZeroCopyStream(&reader)) {
      return absl::OkStatus();
    }
  }
  return absl::InvalidArgumentError(absl::StrCat("the ", bytes.Valid() ? bytes.Length() : 0,
                                                 " bytes of the request are not a ",
                                                 message->GetDescriptor()->full_name()));
}

absl::Status Serialize(const google::protobuf::Message& message, grpc::ByteBuffer* bytes) {
  grpc::ByteBuffer packed;  // the writer takes none that holds something
  grpc::ProtoBufferWriter writer(&packed, grpc::kProtoBufferWriterMaxBufferLength,
                                 static_cast<int>(message.ByteSizeLong()));
  if (!message.SerializeToZeroCopyStream(&writer)) {
    return absl::InternalError("the answer could not be packed");
  }
  bytes->Swap(&packed);
  return absl::OkStatus();
}

}  // namespace scanloc::server
