#include "scanloc/client/client.hpp"

#include <grpc/support/time.h>
#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <fstream>
#include <iterator>
#include <random>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "backoff.hpp"
#include "grpc/health/v1/health.grpc.pb.h"
#include "map_cache.hpp"
#include "request_id.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/status.hpp"
#include "scanloc/v1/admin.grpc.pb.h"
#include "scanloc/v1/localization.grpc.pb.h"
#include "stream_call.hpp"
#include "token.hpp"

namespace scanloc::client {
namespace {

/// Not the time of day: that may be set while a call runs.
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// What one call is bound to, however often it is tried.
struct Terms {
  Clock::time_point deadline;
  std::string request_id;
};

/// The same moment, as gRPC counts it.
gpr_timespec ToGpr(Clock::time_point time) {
  const auto left =
      std::chrono::duration_cast<std::chrono::nanoseconds>(time - Clock::now()).count();
  return gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC), gpr_time_from_nanos(left, GPR_TIMESPAN));
}

constexpr milliseconds kMaxTimeout = std::chrono::hours(1);

absl::Status CheckTimeout(const char* field, milliseconds timeout, milliseconds low) {
  if (timeout >= low && timeout <= kMaxTimeout) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(field, " is ", timeout.count(),
                                                 " ms; it must lie in [", low.count(), ", ",
                                                 kMaxTimeout.count(), "] ms"));
}

absl::Status CheckScanSize(PointView scan) {
  if (scan.size() <= limits::kMaxPointsPerScan) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("the scan has ", scan.size(), " points; at most ",
                                                 limits::kMaxPointsPerScan, " make a scan"));
}

absl::StatusOr<std::string> ReadPem(const std::string& path) {
  if (path.empty()) return std::string();
  std::ifstream file(path);
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file || text.find("-----BEGIN ") == std::string::npos) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", path, "' cannot be read or is not in PEM format"));
  }
  return text;
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> MakeCredentials(
    const ClientOptions& options) {
  if (options.tls_ca_file.empty()) return grpc::InsecureChannelCredentials();
  const absl::StatusOr<std::string> ca = ReadPem(options.tls_ca_file);
  const absl::StatusOr<std::string> cert = ReadPem(options.tls_cert_file);
  const absl::StatusOr<std::string> key = ReadPem(options.tls_key_file);
  for (const auto* file : {&ca, &cert, &key}) {
    if (!file->ok()) return file->status();
  }
  return grpc::SslCredentials({*ca, *key, *cert});
}

std::shared_ptr<grpc::Channel> MakeChannel(
    const ClientOptions& options, const std::shared_ptr<grpc::ChannelCredentials>& credentials) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(limits::kMaxMessageBytes);
  if (!options.tls_server_name.empty()) {
    arguments.SetSslTargetNameOverride(options.tls_server_name);
  }
  return grpc::CreateCustomChannel(options.address, credentials, arguments);
}

double DrawShare() {
  thread_local std::mt19937_64 random{std::random_device{}()};
  return static_cast<double>(random() >> 11) / static_cast<double>(1ULL << 53);
}

absl::Status CheckRetry(const RetryOptions& retry) {
  constexpr int kMaxAttempts = 100;
  if (retry.max_attempts >= 1 && retry.max_attempts <= kMaxAttempts) {
    absl::Status status = CheckTimeout("initial_backoff", retry.initial_backoff, milliseconds(1));
    status.Update(CheckTimeout("max_backoff", retry.max_backoff, retry.initial_backoff));
    return status;
  }
  return absl::InvalidArgumentError(absl::StrCat("max_attempts is ", retry.max_attempts,
                                                 "; it must lie in [1, ", kMaxAttempts, "]"));
}

/// Ends at the first failure: a robot should learn at once that nobody listens there.
bool AwaitReady(grpc::Channel& channel, Clock::time_point deadline) {
  while (true) {
    const grpc_connectivity_state state = channel.GetState(/*try_to_connect=*/true);
    if (state == GRPC_CHANNEL_READY) return true;
    if (state == GRPC_CHANNEL_TRANSIENT_FAILURE || state == GRPC_CHANNEL_SHUTDOWN) return false;
    if (!channel.WaitForStateChange(state, ToGpr(deadline))) return false;
  }
}

}  // namespace

absl::Status Validate(const ClientOptions& options) {
  if (options.address.empty()) {
    return absl::InvalidArgumentError("address is empty; it must be HOST:PORT");
  }
  if (options.tls_cert_file.empty() != options.tls_key_file.empty() ||
      (options.tls_ca_file.empty() && !options.tls_cert_file.empty())) {
    return absl::InvalidArgumentError(
        "a certificate needs its private key and the CA of the server; give all three");
  }
  if (options.tls_ca_file.empty() && !options.tls_server_name.empty()) {
    return absl::InvalidArgumentError(
        "a server's name is checked only where there is a CA for its certificate; give both");
  }
  if (auto token = CheckToken(options); !token.ok()) return token;
  absl::Status status = CheckTimeout("timeout", options.timeout, milliseconds(1));
  status.Update(CheckTimeout("connect_timeout", options.connect_timeout, milliseconds(0)));
  status.Update(CheckRetry(options.retry));
  return status;
}

struct Client::State {
  State(const ClientOptions& client_options,
        const std::shared_ptr<grpc::ChannelCredentials>& credentials)
      : options(client_options),
        channel(MakeChannel(client_options, credentials)),
        stub(v1::Localization::NewStub(channel)),
        admin(v1::Admin::NewStub(channel)) {}

  [[nodiscard]] absl::Status WithAddress(const absl::Status& status) const {
    if (status.ok()) return status;
    absl::Status told(status.code(),
                      absl::StrCat("scanlocd at ", options.address, ": ", status.message()));
    if (const auto delay_s = proto::RetryAfter(status))
      return proto::WithRetryAfter(told, *delay_s);
    return told;
  }

  /// The server's answer is at fault, not the caller's argument.
  [[nodiscard]] absl::Status BadReply(const absl::Status& status) const {
    return WithAddress(absl::InternalError(
        absl::StrCat("its answer makes no sense, is it of another version? ", status.message())));
  }

  /// Of a call that begins now. InvalidArgument: it may not have these.
  [[nodiscard]] absl::StatusOr<Terms> TermsOf(const std::optional<milliseconds>& timeout,
                                              const std::string& request_id = "") const {
    if (timeout) {
      if (auto status = CheckTimeout("timeout", *timeout, milliseconds(1)); !status.ok()) {
        return status;
      }
    }
    if (auto status = CheckRequestId(request_id); !status.ok()) return status;
    return Terms{.deadline = Clock::now() + timeout.value_or(options.timeout),
                 .request_id = request_id};
  }
  [[nodiscard]] Terms UsualTerms() const {
    return {.deadline = Clock::now() + options.timeout, .request_id = {}};
  }

  template <typename Stub, typename Request, typename Response>
  using Method = grpc::Status (Stub::*)(grpc::ClientContext*, const Request&, Response*);

  template <typename Request, typename Response>
  [[nodiscard]] absl::StatusOr<Response> Call(
      Method<v1::Localization::Stub, Request, Response> method, const Request& request,
      const Terms& terms) const {
    Backoff backoff(options.retry, DrawShare);
    while (true) {
      auto response = CallOn(*stub, method, request, terms);
      if (response.ok()) return response;
      const auto wait = backoff.After(response.status());
      const Clock::time_point again = Clock::now() + wait.value_or(milliseconds(0));
      if (!wait || again >= terms.deadline) return response;
      std::this_thread::sleep_until(again);
    }
  }

  template <typename Stub, typename Request, typename Response>
  [[nodiscard]] absl::StatusOr<Response> CallOn(Stub& service,
                                                Method<Stub, Request, Response> method,
                                                const Request& request, const Terms& terms) const {
    grpc::ClientContext context;
    context.set_deadline(ToGpr(terms.deadline));
    ShowToken(options, context);
    SendRequestId(terms.request_id, context);
    Response response;
    const absl::Status status = proto::FromGrpc((service.*method)(&context, request, &response));
    // Nobody here cancels: it is how gRPC ends calls that meet a server in its last moment.
    if (absl::IsCancelled(status)) {
      return WithAddress(absl::UnavailableError("it stopped before it could answer"));
    }
    if (!status.ok()) return WithAddress(status);
    return response;
  }

  /// Reload or load.
  template <typename Request, typename Response>
  [[nodiscard]] absl::StatusOr<MapSummary> Change(
      Method<v1::Admin::Stub, Request, Response> method, const std::string& map,
      const std::optional<milliseconds>& timeout) const {
    const auto terms = TermsOf(timeout);
    if (!terms.ok()) return terms.status();
    Request request;
    request.set_map(map);
    const auto response = CallOn(*admin, method, request, *terms);
    if (!response.ok()) return response.status();
    v1::ListMapsResponse list;
    *list.add_maps() = response->map();
    auto maps = proto::FromProto(list);
    if (!maps.ok()) return BadReply(maps.status());
    return std::move(maps->front());
  }

  [[nodiscard]] absl::StatusOr<MapInfo> FetchInfo(const std::string& map,
                                                  const Terms& terms) const {
    v1::GetMapInfoRequest request;
    request.set_map(map);
    const auto response = Call(&v1::Localization::Stub::GetMapInfo, request, terms);
    if (!response.ok()) return response.status();
    auto info = proto::FromProto(response->info());
    if (!info.ok()) return BadReply(info.status());
    return info;
  }

  [[nodiscard]] absl::StatusOr<LocalizeReply> Localize(v1::LocalizeRequest request,
                                                       const RequestOptions& request_options,
                                                       const Terms& terms) const {
    request.set_map(request_options.map);
    *request.mutable_options() = proto::ToProto(request_options.query);
    const auto response = Call(&v1::Localization::Stub::Localize, request, terms);
    if (!response.ok()) return response.status();
    auto reply = proto::FromProto(*response);
    if (!reply.ok()) return BadReply(reply.status());
    return reply;
  }

  [[nodiscard]] absl::StatusOr<LocalizeReply> LocalizeWith(CachedMap& map, PointView scan,
                                                           const RequestOptions& request_options,
                                                           const Terms& terms) const {
    const auto descriptor = map.Describe(scan);
    if (!descriptor.ok()) return descriptor.status();
    v1::LocalizeRequest request;
    *request.mutable_descriptors() = proto::ToProto(*descriptor);
    return Localize(std::move(request), request_options, terms);
  }

  const ClientOptions options;
  const std::shared_ptr<grpc::Channel> channel;
  const std::unique_ptr<v1::Localization::Stub> stub;
  const std::unique_ptr<v1::Admin::Stub> admin;
  MapCache cache;
};

absl::StatusOr<Client> Client::Connect(const ClientOptions& options) {
  if (auto status = Validate(options); !status.ok()) return status;
  const auto credentials = MakeCredentials(options);
  if (!credentials.ok()) return credentials.status();
  auto state = std::make_shared<State>(options, *credentials);
  if (options.connect_timeout.count() > 0 &&
      !AwaitReady(*state->channel, Clock::now() + options.connect_timeout)) {
    return state->WithAddress(
        absl::UnavailableError("cannot connect; is it running, and is the address right?"));
  }
  return Client(std::move(state));
}

Client::Client(std::shared_ptr<State> state) : state_(std::move(state)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

absl::StatusOr<std::vector<MapSummary>> Client::ListMaps() const {
  const auto response =
      state_->Call(&v1::Localization::Stub::ListMaps, v1::ListMapsRequest(), state_->UsualTerms());
  if (!response.ok()) return response.status();
  auto maps = proto::FromProto(*response);
  if (!maps.ok()) return state_->BadReply(maps.status());
  return maps;
}

absl::StatusOr<MapInfo> Client::GetMapInfo(const std::string& map) const {
  return state_->FetchInfo(map, state_->UsualTerms());
}

absl::StatusOr<bool> Client::IsServing(const std::string& map) const {
  using grpc::health::v1::Health;
  using grpc::health::v1::HealthCheckResponse;
  const auto health = Health::NewStub(state_->channel);
  grpc::health::v1::HealthCheckRequest request;
  if (!map.empty()) request.set_service(absl::StrCat("scanloc.map/", map));
  const auto response =
      state_->CallOn(*health, &Health::Stub::Check, request, state_->UsualTerms());
  if (!response.ok()) return response.status();
  return response->status() == HealthCheckResponse::SERVING;
}

absl::StatusOr<MapSummary> Client::ReloadMap(const std::string& map,
                                             std::optional<milliseconds> timeout) const {
  return state_->Change(&v1::Admin::Stub::ReloadMap, map, timeout);
}

absl::StatusOr<MapSummary> Client::LoadMap(const std::string& map,
                                           std::optional<milliseconds> timeout) const {
  return state_->Change(&v1::Admin::Stub::LoadMap, map, timeout);
}

absl::Status Client::UnloadMap(const std::string& map) const {
  v1::UnloadMapRequest request;
  request.set_map(map);
  return state_->CallOn(*state_->admin, &v1::Admin::Stub::UnloadMap, request, state_->UsualTerms())
      .status();
}

absl::StatusOr<LocalizeReply> Client::LocalizeScan(PointView scan,
                                                   const RequestOptions& options) const {
  const auto terms = state_->TermsOf(options.timeout, options.request_id);
  if (!terms.ok()) return terms.status();
  if (auto status = CheckScanSize(scan); !status.ok()) return status;
  v1::LocalizeRequest request;
  *request.mutable_scan() = proto::ToProto(scan);
  return state_->Localize(std::move(request), options, *terms);
}

absl::StatusOr<LocalizeReply> Client::LocalizeDescriptor(const SignedDescriptor& descriptor,
                                                         const RequestOptions& options) const {
  const auto terms = state_->TermsOf(options.timeout, options.request_id);
  if (!terms.ok()) return terms.status();
  v1::LocalizeRequest request;
  *request.mutable_descriptors() = proto::ToProto(descriptor);
  return state_->Localize(std::move(request), options, *terms);
}

absl::StatusOr<LocalizeReply> Client::LocalizeByDescriptor(PointView scan,
                                                           const RequestOptions& options) const {
  const auto terms = state_->TermsOf(options.timeout, options.request_id);
  if (!terms.ok()) return terms.status();
  const auto fetch = [&]() -> absl::StatusOr<std::shared_ptr<CachedMap>> {
    const auto info = state_->FetchInfo(options.map, *terms);
    if (!info.ok()) return info.status();
    return state_->cache.Put(options.map, *info);
  };

  absl::StatusOr<std::shared_ptr<CachedMap>> map = state_->cache.Find(options.map);
  if (*map == nullptr) map = fetch();
  if (!map.ok()) return map.status();
  auto reply = state_->LocalizeWith(**map, scan, options, *terms);
  if (absl::IsFailedPrecondition(reply.status())) {
    // Either the map has got other parameters, or the query asks for what it does not serve.
    const auto newer = fetch();
    if (!newer.ok()) return newer.status();
    if ((*newer)->signature() == (*map)->signature()) return reply;
    map = newer;
    reply = state_->LocalizeWith(**map, scan, options, *terms);
  }
  if (reply.ok() && reply->answer.content_id != (*map)->content_id()) {
    state_->cache.Forget(options.map, *map);
  }
  return reply;
}

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
    *request->mutable_query()->mutable_options() = proto::ToProto(state_->options.query);
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
