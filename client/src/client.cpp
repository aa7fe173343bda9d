#include "scanloc/client/client.hpp"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <cstdint>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_state.hpp"
#include "grpc/health/v1/health.grpc.pb.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::client {

using std::chrono::milliseconds;

namespace {

/// gRPC would go on to two minutes while a server is away, and then be as late to find it back.
constexpr int kLongestReconnectBackoff_ms = 5000;

absl::StatusOr<std::string> ReadPem(const std::string& path) {
  constexpr std::int64_t kMostBytes = 4 << 20;  // more than the certificates of every CA there is
  if (path.empty()) return std::string();
  absl::StatusOr<std::string> text = ReadFile(path, kMostBytes);
  if (!text.ok()) return absl::InvalidArgumentError(text.status().message());
  if (text->find("-----BEGIN ") != std::string::npos) return text;
  return absl::InvalidArgumentError(absl::StrCat("'", path, "' is not in PEM format"));
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

// A channel that is not connected yet. InvalidArgument if a file for TLS cannot be read.
absl::StatusOr<std::shared_ptr<grpc::Channel>> MakeChannel(const ClientOptions& options) {
  ASSIGN_OR_RETURN(const auto credentials, MakeCredentials(options));
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(limits::kMaxMessageBytes);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kLongestReconnectBackoff_ms);
  if (!options.tls_server_name.empty()) {
    arguments.SetSslTargetNameOverride(options.tls_server_name);
  }
  return grpc::CreateCustomChannel(options.address, credentials, arguments);
}

// Ends at the first failure: a robot should learn at once that nobody listens there.
bool AwaitReady(grpc::Channel& channel, Clock::time_point deadline) {
  while (true) {
    const grpc_connectivity_state state = channel.GetState(/*try_to_connect=*/true);
    if (state == GRPC_CHANNEL_READY) return true;
    if (state == GRPC_CHANNEL_TRANSIENT_FAILURE || state == GRPC_CHANNEL_SHUTDOWN) return false;
    if (!channel.WaitForStateChange(state, ToGpr(deadline))) return false;
  }
}

// Of a channel that has just failed to connect: what gRPC knows of it comes with a call alone.
absl::Status WhyNotConnected(v1::Localization::Stub& stub, const ClientOptions& options) {
  constexpr milliseconds kMoment(100);
  grpc::ClientContext context;
  context.set_deadline(ToGpr(Clock::now() + kMoment));
  v1::ListMapsResponse response;
  const grpc::Status status = stub.ListMaps(&context, {}, &response);
  const bool is_told = status.error_code() == grpc::StatusCode::UNAVAILABLE;
  const char* how = options.tls_ca_file.empty()     ? "without TLS"
                    : options.tls_cert_file.empty() ? "by TLS, without a certificate of its own"
                                                    : "by TLS, with a certificate of its own";
  return absl::UnavailableError(absl::StrCat(
      "cannot connect ", how, "; is it running, is the address right, and does it expect that? ",
      is_told ? status.error_message() : "It says nothing"));
}

}  // namespace

absl::StatusOr<Client> Client::Connect(const ClientOptions& options) {
  RETURN_IF_ERROR(Validate(options));
  ASSIGN_OR_RETURN(auto channel, MakeChannel(options));
  auto state = std::make_shared<State>(options, std::move(channel));
  if (options.connect_timeout.count() > 0 &&
      !AwaitReady(*state->channel, Clock::now() + options.connect_timeout)) {
    return state->WithAddress(WhyNotConnected(*state->stub, options));
  }
  return Client(std::move(state));
}

Client::Client(std::shared_ptr<State> state) : state_(std::move(state)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

absl::StatusOr<std::vector<MapSummary>> Client::ListMaps() const {
  ASSIGN_OR_RETURN(const auto response, state_->Call(&v1::Localization::Stub::ListMaps,
                                                     v1::ListMapsRequest(), state_->UsualTerms()));
  return state_->Read(response);
}

absl::StatusOr<MapInfo> Client::GetMapInfo(const std::string& map) const {
  return state_->FetchInfo(map, state_->UsualTerms());
}

absl::StatusOr<PlacesPage> Client::ListPlaces(const std::string& map,
                                              const std::string& page_token) const {
  v1::ListPlacesRequest request;
  request.set_map(map);
  request.set_page_token(page_token);
  ASSIGN_OR_RETURN(const auto response, state_->Call(&v1::Localization::Stub::ListPlaces, request,
                                                     state_->UsualTerms()));
  return state_->Read(response);
}

absl::StatusOr<PlaceDetails> Client::GetPlace(const std::string& map, std::int32_t place) const {
  v1::GetPlaceRequest request;
  request.set_map(map);
  request.set_place(place);
  return state_->View(&v1::Viewer::Stub::GetPlace, request);
}

absl::StatusOr<ConfusablePairs> Client::ListConfusablePairs(const std::string& map) const {
  v1::ListConfusablePairsRequest request;
  request.set_map(map);
  return state_->View(&v1::Viewer::Stub::ListConfusablePairs, request);
}

absl::StatusOr<MapUse> Client::GetMapUse(const std::string& map) const {
  MapUse whole;
  v1::ListPlaceUseRequest request;
  request.set_map(map);
  while (true) {
    ASSIGN_OR_RETURN(auto page, state_->View(&v1::Viewer::Stub::ListPlaceUse, request));
    const std::int32_t first = request.first_place();
    if (first > 0 && page.use.content_id != whole.content_id) {
      return absl::AbortedError("the map was replaced meanwhile; ask again");
    }
    page.use.places.merge(whole.places);
    whole = std::move(page.use);
    if (page.next_place == 0) return whole;
    if (page.next_place <= first) return absl::InternalError("the server's pages go backwards");
    request.set_first_place(page.next_place);
  }
}

absl::StatusOr<AnswersPage> Client::ListAnswers(const std::string& map,
                                                const AnswersPage& last) const {
  v1::ListAnswersRequest request;
  request.set_map(map);
  request.set_run(last.run);
  request.set_after(last.next_after);
  return state_->View(&v1::Viewer::Stub::ListAnswers, request);
}

absl::StatusOr<bool> Client::IsServing(const std::string& map) const {
  using grpc::health::v1::Health;
  using grpc::health::v1::HealthCheckResponse;
  const auto health = Health::NewStub(state_->channel);
  grpc::health::v1::HealthCheckRequest request;
  if (!map.empty()) request.set_service(absl::StrCat("scanloc.map/", map));
  ASSIGN_OR_RETURN(const auto response,
                   state_->CallOn(*health, &Health::Stub::Check, request, state_->UsualTerms()));
  return response.status() == HealthCheckResponse::SERVING;
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
  ASSIGN_OR_RETURN(const auto terms, state_->TermsOf(options.timeout, options.request_id));
  RETURN_IF_ERROR(CheckScanSize(scan));
  v1::LocalizeRequest request;
  *request.mutable_scan() = proto::ToProto(scan, options.mount);
  return state_->Localize(std::move(request), options, terms);
}

absl::StatusOr<LocalizeReply> Client::LocalizeDescriptor(const SignedDescriptor& descriptor,
                                                         const RequestOptions& options) const {
  ASSIGN_OR_RETURN(const auto terms, state_->TermsOf(options.timeout, options.request_id));
  v1::LocalizeRequest request;
  *request.mutable_descriptors() = proto::ToProto(descriptor);
  return state_->Localize(std::move(request), options, terms);
}

absl::StatusOr<LocalizeReply> Client::LocalizeByDescriptor(PointView scan,
                                                           const RequestOptions& options) const {
  ASSIGN_OR_RETURN(const auto terms, state_->TermsOf(options.timeout, options.request_id));
  absl::StatusOr<std::shared_ptr<CachedMap>> map = state_->cache.Find(options.map);
  if (*map == nullptr) map = state_->FetchMap(options.map, terms);
  const auto are_several = [&](const absl::Status& status) {
    return options.map.empty() && absl::IsNotFound(status);
  };
  // They may want several descriptors.
  if (are_several(map.status())) return LocalizeScan(scan, options);
  if (!map.ok()) return map.status();
  auto reply = state_->LocalizeWith(**map, scan, options, terms);
  if (absl::IsFailedPrecondition(reply.status())) {
    // Either the map has got other parameters, or the query asks for what it does not serve.
    const auto newer = state_->FetchMap(options.map, terms);
    if (are_several(newer.status())) return LocalizeScan(scan, options);
    if (!newer.ok()) return newer.status();
    if ((*newer)->signature() == (*map)->signature()) return reply;
    map = newer;
    reply = state_->LocalizeWith(**map, scan, options, terms);
  }
  if (reply.ok() && reply->answer.content_id != (*map)->content_id()) {
    state_->cache.Forget(options.map, *map);
  }
  return reply;
}

}  // namespace scanloc::client
