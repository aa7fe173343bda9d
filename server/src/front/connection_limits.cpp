#include "front/connection_limits.hpp"

#include <grpcpp/resource_quota.h>

#include <cstddef>

namespace scanloc::server {
namespace {

// One robot asks one thing at a time; a proxy in front of many shares a connection among them.
constexpr int kMaxCalls = 256;
// Its own services take none.
constexpr int kMaxGrpcThreads = 16;
// A client may ping this often; one that does so faster is told to go away.
constexpr int kMinPingInterval_ms = 10'000;
constexpr int kMaxPingStrikes = 5;
// All headers of a call [bytes]. A call with more ends its whole connection (gRPC loses its place
// in the compressed headers), and with it the calls of others behind the same proxy.
constexpr int kMaxHeaderBytes = 64 << 10;
constexpr int kHandshakeTimeout_ms = 10'000;
// Connections that carry nothing are closed; clients open them again when they need them.
constexpr int kMaxIdle_ms = 10 * 60 * 1000;
// The server looks whether silent peers are still there.
constexpr int kPingInterval_ms = 60'000;
constexpr int kPingTimeout_ms = 20'000;
// What has been read is taken in to the end, however many calls it holds. By default 4 MiB.
constexpr int kMaxReadBytes = 128 << 10;

}  // namespace

void LimitConnections(grpc::ServerBuilder& builder, std::int64_t max_memory_bytes) {
  grpc::ResourceQuota quota("scanlocd");
  quota.Resize(static_cast<std::size_t>(max_memory_bytes));
  quota.SetMaxThreads(kMaxGrpcThreads);
  builder.SetResourceQuota(quota);
  builder.AddChannelArgument(GRPC_ARG_ENABLE_PER_MESSAGE_DECOMPRESSION, 0);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxCalls);
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, kMaxHeaderBytes);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                             kMinPingInterval_ms);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PING_STRIKES, kMaxPingStrikes);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeTimeout_ms);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, kMaxIdle_ms);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kPingInterval_ms);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kPingTimeout_ms);
  builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, kMaxReadBytes);
}

}  // namespace scanloc::server
