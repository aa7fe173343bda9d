#include "connection_limits.hpp"

namespace scanloc::server {
namespace {

// One robot asks one thing at a time; a proxy in front of many shares a connection among them.
constexpr int kMaxCalls = 256;
// A client may ping this often; one that does so faster is told to go away.
constexpr int kMinPingInterval_ms = 10'000;
constexpr int kMaxPingStrikes = 5;
constexpr int kHandshakeTimeout_ms = 10'000;
// Connections that carry nothing are closed; clients open them again when they need them.
constexpr int kMaxIdle_ms = 10 * 60 * 1000;
// The server looks whether silent peers are still there.
constexpr int kPingInterval_ms = 60'000;
constexpr int kPingTimeout_ms = 20'000;

}  // namespace

void LimitConnections(grpc::ServerBuilder& builder) {
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxCalls);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                             kMinPingInterval_ms);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PING_STRIKES, kMaxPingStrikes);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeTimeout_ms);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, kMaxIdle_ms);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kPingInterval_ms);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kPingTimeout_ms);
  // Two servers on one port would share its robots at random.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
}

}  // namespace scanloc::server
