#include "front/self_check.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <memory>
#include <string_view>
#include <utility>

#include "absl/strings/numbers.h"

namespace scanloc::server {
namespace {

constexpr const char* kProbeName = "scanlocd's own probe";

std::string TextOf(BIO& memory) {
  char* text = nullptr;
  const long size = BIO_get_mem_data(&memory, &text);
  return {text, static_cast<std::size_t>(size)};
}

bool Fill(X509& certificate, EVP_PKEY* key) {
  X509_NAME* name = X509_get_subject_name(&certificate);
  return X509_set_version(&certificate, 2) == 1 &&  // counted from 0: version 3
         ASN1_INTEGER_set(X509_get_serialNumber(&certificate), 1) == 1 &&
         ASN1_TIME_set_string(X509_getm_notBefore(&certificate), "19700101000000Z") == 1 &&
         ASN1_TIME_set_string(X509_getm_notAfter(&certificate), "99991231235959Z") == 1 &&
         X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC,
                                    reinterpret_cast<const unsigned char*>(kProbeName), -1, -1,
                                    0) == 1 &&
         X509_set_issuer_name(&certificate, name) == 1 && X509_set_pubkey(&certificate, key) == 1 &&
         X509_sign(&certificate, key, EVP_sha256()) != 0;
}

constexpr std::size_t kFrameHeaderBytes = 9;
/// More than any answer to a health check has.
constexpr std::size_t kMaxReceivedBytes = 65536;
constexpr std::uint32_t kStream = 1;

std::string BigEndian(std::uint32_t value, int num_bytes) {
  std::string bytes;
  for (int shift = 8 * (num_bytes - 1); shift >= 0; shift -= 8) {
    bytes += static_cast<char>(value >> shift);
  }
  return bytes;
}

enum FrameType : char { kData = 0, kHeaders = 1, kSettings = 4 };
enum FrameFlags : char { kNone = 0, kEndStream = 1, kEndHeaders = 4 };

std::string Frame(FrameType type, FrameFlags flags, std::uint32_t stream,
                  const std::string& bytes) {
  return BigEndian(static_cast<std::uint32_t>(bytes.size()), 3) + static_cast<char>(type) +
         static_cast<char>(flags) + BigEndian(stream, 4) + bytes;
}

std::string Header(std::string_view name, std::string_view value) {
  std::string bytes(1, '\0');  // not to be remembered
  for (const std::string_view text : {name, value}) {
    bytes += static_cast<char>(text.size());
    bytes += text;
  }
  return bytes;
}

/// A whole Check of the server as such, as HTTP/2 sends it.
std::string Question() {
  return "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + Frame(kSettings, kNone, 0, "") +
         Frame(kHeaders, kEndHeaders, kStream,
               Header(":method", "POST") + Header(":scheme", "http") +
                   Header(":path", "/grpc.health.v1.Health/Check") +
                   Header(":authority", "localhost") + Header("te", "trailers") +
                   Header("content-type", "application/grpc")) +
         Frame(kData, kEndStream, kStream, std::string(5, '\0'));  // an empty message
}

/// Of HOST:PORT, HOST a number.
socklen_t Parse(const std::string& address, sockaddr_storage& parsed) {
  const std::size_t colon = address.rfind(':');
  int port = 0;
  (void)absl::SimpleAtoi(address.substr(colon + 1), &port);
  const auto in_order = htons(static_cast<std::uint16_t>(port));
  if (address.starts_with('[')) {
    auto& v6 = reinterpret_cast<sockaddr_in6&>(parsed);
    v6.sin6_family = AF_INET6;
    v6.sin6_port = in_order;
    inet_pton(AF_INET6, address.substr(1, colon - 2).c_str(), &v6.sin6_addr);
    return sizeof v6;
  }
  auto& v4 = reinterpret_cast<sockaddr_in&>(parsed);
  v4.sin_family = AF_INET;
  v4.sin_port = in_order;
  inet_pton(AF_INET, address.substr(0, colon).c_str(), &v4.sin_addr);
  return sizeof v4;
}

bool IsToWait() {
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == ENOTCONN || errno == EINTR;
}

}  // namespace

struct ProbeTls::Context {
  ~Context() { SSL_CTX_free(context); }
  SSL_CTX* context = SSL_CTX_new(TLS_client_method());
};

ProbeTls::ProbeTls(std::unique_ptr<Context> context) : context_(std::move(context)) {}
ProbeTls::~ProbeTls() = default;

absl::StatusOr<std::unique_ptr<ProbeTls>> ProbeTls::Make(const OwnIdentity& identity) {
  const auto read = [](const std::string& pem) {
    return std::unique_ptr<BIO, decltype(&BIO_free)>(
        BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())), BIO_free);
  };
  const std::unique_ptr<X509, decltype(&X509_free)> cert(
      PEM_read_bio_X509(read(identity.cert).get(), nullptr, nullptr, nullptr), X509_free);
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(
      PEM_read_bio_PrivateKey(read(identity.key).get(), nullptr, nullptr, nullptr), EVP_PKEY_free);
  auto made = std::make_unique<Context>();
  constexpr unsigned char kProtocol[] = {2, 'h', '2'};
  if (made->context == nullptr || SSL_CTX_use_certificate(made->context, cert.get()) != 1 ||
      SSL_CTX_use_PrivateKey(made->context, key.get()) != 1 ||
      SSL_CTX_set_alpn_protos(made->context, kProtocol, sizeof kProtocol) != 0) {
    return absl::InternalError("cannot make ready to ask this server itself over TLS");
  }
  return std::unique_ptr<ProbeTls>(new ProbeTls(std::move(made)));
}

/// Between bytes in the clear and bytes on the wire.
struct SelfCheck::Tls {
  explicit Tls(SSL_CTX* context) : ssl(SSL_new(context)) {
    SSL_set_bio(ssl, from_wire, to_wire);
    SSL_set_connect_state(ssl);
  }
  ~Tls() { SSL_free(ssl); }
  Tls(const Tls&) = delete;
  Tls& operator=(const Tls&) = delete;

  BIO* const from_wire = BIO_new(BIO_s_mem());  // of ssl, like the next
  BIO* const to_wire = BIO_new(BIO_s_mem());
  SSL* const ssl;
};

SelfCheck::SelfCheck(const std::string& address, const ProbeTls* tls) {
  sockaddr_storage at = {};
  const socklen_t size = Parse(address, at);
  socket_ = socket(at.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket_ < 0) return;
  if (tls == nullptr) {
    to_send_ = Question();
  } else {
    to_encrypt_ = Question();
    tls_ = std::make_unique<Tls>(tls->context_->context);
  }
  if (connect(socket_, reinterpret_cast<sockaddr*>(&at), size) == 0 || errno == EINPROGRESS) return;
  close(std::exchange(socket_, -1));
}

SelfCheck::~SelfCheck() {
  if (socket_ >= 0) close(socket_);
}

SelfCheck::Outcome SelfCheck::Await(std::chrono::milliseconds patience) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (true) {
    if (const Outcome outcome = Proceed(); outcome != Outcome::kNoneYet) return outcome;
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    if (left.count() <= 0) return Outcome::kNoneYet;
    pollfd wait = {.fd = socket_, .events = POLLIN, .revents = 0};
    if (!to_send_.empty()) wait.events |= POLLOUT;
    poll(&wait, 1, static_cast<int>(left.count()));
  }
}

SelfCheck::Outcome SelfCheck::Proceed() {
  const bool is_open = socket_ >= 0 && Receive() && (tls_ == nullptr || Encrypt()) && Send();
  if (HasAnswer()) return Outcome::kAnswered;
  return is_open ? Outcome::kNoneYet : Outcome::kFailed;
}

bool SelfCheck::Receive() {
  std::array<char, 4096> bytes{};
  while (received_.size() < kMaxReceivedBytes) {
    const ssize_t count = recv(socket_, bytes.data(), bytes.size(), 0);
    if (count < 0) return IsToWait();
    if (count == 0) return false;
    if (tls_ != nullptr) {
      BIO_write(tls_->from_wire, bytes.data(), static_cast<int>(count));
    } else {
      received_.append(bytes.data(), static_cast<std::size_t>(count));
    }
  }
  return false;
}

bool SelfCheck::Encrypt() {
  const auto is_waiting = [this](int result) {
    return SSL_get_error(tls_->ssl, result) == SSL_ERROR_WANT_READ;
  };
  bool is_well = true;
  if (const int shaken = SSL_do_handshake(tls_->ssl); shaken != 1) {
    is_well = is_waiting(shaken);
  } else {
    if (!to_encrypt_.empty()) {
      const int count =
          SSL_write(tls_->ssl, to_encrypt_.data(), static_cast<int>(to_encrypt_.size()));
      if (count > 0) to_encrypt_.erase(0, static_cast<std::size_t>(count));
    }
    std::array<char, 4096> bytes{};
    int count = 0;
    while ((count = SSL_read(tls_->ssl, bytes.data(), bytes.size())) > 0) {
      received_.append(bytes.data(), static_cast<std::size_t>(count));
    }
    is_well = is_waiting(count);
  }
  std::array<char, 4096> bytes{};
  int count = 0;
  while ((count = BIO_read(tls_->to_wire, bytes.data(), bytes.size())) > 0) {
    to_send_.append(bytes.data(), static_cast<std::size_t>(count));
  }
  return is_well;
}

bool SelfCheck::Send() {
  while (!to_send_.empty()) {
    const ssize_t count = send(socket_, to_send_.data(), to_send_.size(), MSG_NOSIGNAL);
    if (count < 0) return IsToWait();
    to_send_.erase(0, static_cast<std::size_t>(count));
  }
  return true;
}

bool SelfCheck::HasAnswer() const {
  const auto number = [this](std::size_t at, std::size_t count) {
    std::uint32_t value = 0;
    for (std::size_t i = at; i < at + count; ++i) {
      value = value << 8 | static_cast<unsigned char>(received_[i]);
    }
    return value;
  };
  for (std::size_t at = 0; at + kFrameHeaderBytes <= received_.size();
       at += kFrameHeaderBytes + number(at, 3)) {
    if (received_[at + 3] == kHeaders && number(at + 5, 4) == kStream) return true;
  }
  return false;
}

absl::StatusOr<OwnIdentity> MakeOwnIdentity() {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_EC_gen("P-256"), EVP_PKEY_free);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(X509_new(), X509_free);
  const std::unique_ptr<BIO, decltype(&BIO_free)> cert_text(BIO_new(BIO_s_mem()), BIO_free);
  const std::unique_ptr<BIO, decltype(&BIO_free)> key_text(BIO_new(BIO_s_mem()), BIO_free);
  if (key == nullptr || certificate == nullptr || cert_text == nullptr || key_text == nullptr ||
      !Fill(*certificate, key.get()) ||
      PEM_write_bio_X509(cert_text.get(), certificate.get()) != 1 ||
      PEM_write_bio_PrivateKey(key_text.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) !=
          1) {
    return absl::InternalError("cannot make a certificate to ask this server itself with");
  }
  return OwnIdentity{.cert = TextOf(*cert_text), .key = TextOf(*key_text)};
}

}  // namespace scanloc::server
