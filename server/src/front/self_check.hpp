#pragma once

#include <sys/socket.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace scanloc::server {

/// A certificate that trusts in itself, and its key, as PEM texts.
struct OwnIdentity {
  std::string cert;
  std::string key;
};

/// Makes one of which nobody else has the key, valid whatever the clock says: the server shows it
/// when it asks itself, where clients must show a certificate.
[[nodiscard]] absl::StatusOr<OwnIdentity> MakeOwnIdentity();

/// How the server asks itself over TLS.
class ProbeTls {
 public:
  /// Shows the identity where it is asked for one; takes any certificate of the server's.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<ProbeTls>> Make(const OwnIdentity& identity);
  ~ProbeTls();

 private:
  friend class SelfCheck;
  struct Context;
  explicit ProbeTls(std::unique_ptr<Context> context);
  const std::unique_ptr<Context> context_;
};

/// One health check (grpc.health.v1) by a server of itself, over a connection of its own. Made by
/// hand: a thread that waits for an answer in gRPC may be made to work for other connections first,
/// for ever if they send enough.
class SelfCheck {
 public:
  enum class Outcome : std::uint8_t { kNoneYet, kAnswered, kFailed };

  /// Asks at the address, HOST:PORT with a number as host; over TLS unless it is null.
  SelfCheck(const std::string& address, const ProbeTls* tls);
  ~SelfCheck();
  SelfCheck(const SelfCheck&) = delete;
  SelfCheck& operator=(const SelfCheck&) = delete;

  /// Waits for so long, or until there is an outcome. Whatever the answer is, it is one.
  [[nodiscard]] Outcome Await(std::chrono::milliseconds patience);

 private:
  struct Tls;

  [[nodiscard]] Outcome Proceed();
  [[nodiscard]] bool Receive();
  [[nodiscard]] bool Encrypt();
  [[nodiscard]] bool Send();
  [[nodiscard]] bool HasAnswer() const;

  int socket_ = -1;
  std::string to_encrypt_;
  std::string to_send_;
  std::string received_;
  std::unique_ptr<Tls> tls_;
};

}  // namespace scanloc::server
