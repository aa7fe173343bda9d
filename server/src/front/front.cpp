#include "front/front.hpp"

#include <grpc/support/time.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/server_builder.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <unordered_map>

#include "rpc/unary_call.hpp"

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

/// Bounds on what one connection may cost, whoever is behind it, and on the memory [bytes] that all
/// of them may have gRPC hold. Compressed messages are refused: a small one may unpack to a large
/// one.
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

/// A client answers the server's goodbye at once, or is as good as gone.
constexpr std::chrono::seconds kMaxSilence(3);
/// For cancelled calls to tell their clients so.
constexpr std::chrono::milliseconds kCancelTime(200);

}  // namespace

/// Finds the method that a call is for.
class Front::Dispatcher final : public grpc::CallbackGenericService {
 public:
  Dispatcher(const CallWaits& waits, const std::vector<const RawService*>& services)
      : waits_(waits) {
    for (const RawService* service : services) {
      for (const auto& [path, begin] : service->methods()) methods_[path] = &begin;
    }
  }

  /// From now on calls end as soon as they begin.
  void Stop() { is_stopped_ = true; }

  grpc::ServerGenericBidiReactor* CreateReactor(
      grpc::GenericCallbackServerContext* context) override {
    if (is_stopped_) return Refuse(*context, absl::UnavailableError("the server is busy"));
    const auto found = methods_.find(context->method());
    if (found != methods_.end()) return (*found->second)(context);
    return Refuse(*context, absl::UnimplementedError("no such method"));
  }

 private:
  RawService::Reactor* Refuse(grpc::CallbackServerContext& context, const absl::Status& why) {
    return InboundCall::Refuse(waits_, context, AddressOf(context), why,
                               [](const absl::Status&) {});
  }

  const CallWaits waits_;
  std::unordered_map<std::string, const RawService::Begin*> methods_;
  std::atomic<bool> is_stopped_ = false;
};

absl::StatusOr<std::unique_ptr<Front>> Front::Open(Listener& listener, const CallWaits& waits,
                                                   const Options& options) {
  auto front = std::unique_ptr<Front>(new Front(listener, waits, options.services));
  grpc::ServerBuilder builder;
  builder.RegisterCallbackGenericService(front->dispatcher_.get());
  builder.SetMaxReceiveMessageSize(options.max_message_bytes);
  LimitConnections(builder, options.max_memory_bytes);
  front->acceptor_ = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, options.credentials);
  front->server_ = builder.BuildAndStart();
  if (front->server_ == nullptr) return absl::UnavailableError("gRPC's server does not start");
  listener.LetIn([acceptor = front->acceptor_.get()](int socket) {
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
    connection.fd = socket;
    acceptor->HandleNewConnection(&connection);
  });
  return front;
}

Front::Front(Listener& listener, const CallWaits& waits,
             const std::vector<const RawService*>& services)
    : listener_(listener), dispatcher_(std::make_unique<Dispatcher>(waits, services)) {}

Front::~Front() {
  HangUp();
  if (server_ != nullptr) server_->Shutdown(gpr_inf_past(GPR_CLOCK_MONOTONIC));
}

void Front::HangUp() {
  dispatcher_->Stop();
  listener_.HangUp();
}

void Front::Shutdown(std::chrono::nanoseconds patience) {
  listener_.Close(kMaxSilence, patience + kCancelTime);
  server_->Shutdown(gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC),
                                 gpr_time_from_nanos(patience.count(), GPR_TIMESPAN)));
}

}  // namespace scanloc::server
