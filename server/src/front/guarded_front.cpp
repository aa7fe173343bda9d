#include "front/guarded_front.hpp"

#include <grpc/grpc.h>
#include <grpc/grpc_security.h>
#include <grpcpp/security/server_credentials.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "front/memory.hpp"
#include "front/tls_files.hpp"
#include "ops/service_manager.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::server {
namespace {

/// gRPC's own watcher of files takes up whatever it finds there, and then fails every handshake; so
/// it is asked to fetch what was checked, for which its C++ interface has no credentials.
class ReloadedCredentials final : public grpc::ServerCredentials {
 public:
  ReloadedCredentials(const TlsFiles& files, std::string own_client_cert)
      : files_(files),
        own_client_cert_(std::move(own_client_cert)),
        credentials_(grpc_ssl_server_credentials_create_with_options(
            grpc_ssl_server_credentials_create_options_using_config_fetcher(
                files.is_mutual() ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                                  : GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE,
                &ReloadedCredentials::Fetch, this))) {}
  ~ReloadedCredentials() override { grpc_server_credentials_release(credentials_); }
  ReloadedCredentials(const ReloadedCredentials&) = delete;
  ReloadedCredentials& operator=(const ReloadedCredentials&) = delete;

  void SetAuthMetadataProcessor(
      const std::shared_ptr<grpc::AuthMetadataProcessor>& /*processor*/) override {
    // Tokens are looked at with each call (Access).
  }

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    return grpc_server_add_http2_port(server, address.c_str(), credentials_);
  }

  /// gRPC calls it before each handshake, one at a time.
  static grpc_ssl_certificate_config_reload_status Fetch(
      void* self, grpc_ssl_server_certificate_config** config) {
    auto& own = *static_cast<ReloadedCredentials*>(self);
    std::shared_ptr<const TlsMaterial> now = own.files_.Current();
    if (now == own.given_) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    const grpc_ssl_pem_key_cert_pair pair = {now->key.c_str(), now->cert.c_str()};
    // gRPC 1.51 ends the process where there is no CA at all; without one for clients, they are not
    // asked for a certificate, and what stands here is not looked at.
    const std::string client_ca =
        now->client_ca.empty() ? now->cert : now->client_ca + "\n" + own.own_client_cert_;
    *config = grpc_ssl_server_certificate_config_create(client_ca.c_str(), &pair, 1);
    own.given_ = std::move(now);
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  }

  const TlsFiles& files_;
  const std::string own_client_cert_;
  std::shared_ptr<const TlsMaterial> given_;
  grpc_server_credentials* const credentials_;
};

/// What connections must show: nothing without files; else the server shows its certificate, and
/// asks for the clients' where there is a CA for them; beside it, `own_client_cert` is good. Each
/// new connection gets what is in force then. For one port of one server, which files and
/// credentials must outlive.
std::shared_ptr<grpc::ServerCredentials> MakeCredentials(const TlsFiles* files,
                                                         const std::string& own_client_cert) {
  if (files == nullptr) return grpc::InsecureServerCredentials();
  return std::make_shared<ReloadedCredentials>(*files, own_client_cert);
}

/// A scan is held as the bytes received, as a message, as points and, while it is described, as
/// voxels.
constexpr std::int64_t kCopiesOfReceived = 4;

}  // namespace

absl::StatusOr<std::unique_ptr<GuardedFront>> GuardedFront::Open(Options options,
                                                                 const CallWaits& waits,
                                                                 MemoryBound& memory) {
  ASSIGN_OR_RETURN(auto identity, MakeOwnIdentity());
  ASSIGN_OR_RETURN(auto tls, ProbeTls::Make(identity));
  ASSIGN_OR_RETURN(auto listener,
                   Listener::Open(options.listen, MaxConnections(options.max_memory_bytes)));
  auto guarded = std::unique_ptr<GuardedFront>(new GuardedFront(
      std::move(options), waits, memory, std::move(listener), identity.cert, std::move(tls)));
  RETURN_IF_ERROR(guarded->MakeFront());
  GuardedFront& own = *guarded;
  own.watchdog_ = std::make_unique<Watchdog>(
      Watchdog::Ward{.ask =
                         [&own] {
                           return std::make_unique<SelfCheck>(
                               own.listener_->own_address(),
                               own.options_.tls == nullptr ? nullptr : own.tls_.get());
                         },
                     .work_bytes = own.options_.work_bytes,
                     // They cannot be more than copies of what was sent; what is, is gRPC's own.
                     .at_hand_bytes =
                         [&own] {
                           return std::min(
                                      own.options_.at_hand_bytes(),
                                      kCopiesOfReceived * own.listener_->num_bytes_received()) +
                                  kBytesPerConnection * own.listener_->num_connections();
                         },
                     .make_anew = [&own](const std::string& why) { own.MakeAnew(why); },
                     .asked =
                         [&own](bool is_answered) {
                           own.options_.asked_itself(is_answered);
                           if (is_answered && IsServiceManagerWatching())
                             TellServiceManager("WATCHDOG=1");
                         }},
      memory);
  return guarded;
}

GuardedFront::GuardedFront(Options options, const CallWaits& waits, MemoryBound& memory,
                           std::unique_ptr<Listener> listener, std::string own_cert,
                           std::unique_ptr<ProbeTls> tls)
    : options_(std::move(options)),
      waits_(waits),
      memory_(memory),
      listener_(std::move(listener)),
      own_cert_(std::move(own_cert)),
      tls_(std::move(tls)) {}

absl::Status GuardedFront::MakeFront() {
  ASSIGN_OR_RETURN(front_, Front::Open(*listener_, waits_,
                                       {.services = options_.services,
                                        .credentials = MakeCredentials(options_.tls, own_cert_),
                                        .max_message_bytes = options_.max_message_bytes,
                                        .max_memory_bytes = options_.max_memory_bytes}));
  return absl::OkStatus();
}

void GuardedFront::MakeAnew(const std::string& why) {
  const std::lock_guard lock(mutex_);
  options_.made_anew(why);
  if (is_draining_) {
    if (front_ != nullptr) front_->HangUp();
    return;
  }
  spdlog::error("all connections are ended and the server's front is made anew: {}",
                why == "memory" ? "clients made it hold more memory than they may"
                                : "it did not answer itself");
  front_.reset();
  ReturnFreedMemory();
  memory_.Accept();
  if (auto status = MakeFront(); !status.ok()) spdlog::error("{}", status.ToString());
}

void GuardedFront::Shutdown(std::chrono::nanoseconds patience) {
  watchdog_->StopAsking();
  {
    const std::lock_guard lock(mutex_);
    is_draining_ = true;
  }
  if (front_ != nullptr) front_->Shutdown(patience);
}

}  // namespace scanloc::server
