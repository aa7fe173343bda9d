#include "front/listen_sockets.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

#include "absl/strings/str_cat.h"

namespace scanloc::server {
namespace {

/// Connections that were made and not yet let in.
constexpr int kBacklog = 4096;
/// What was sent to a peer and not acknowledged for so long will not be.
constexpr unsigned kPeerTimeout_ms = 20'000;

using Addresses = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

absl::StatusOr<Addresses> Resolve(const std::string& host, const std::string& port) {
  addrinfo hints = {};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(host.c_str(), port.c_str(), &hints, &found);
  if (error != 0) return absl::UnavailableError(gai_strerror(error));
  return Addresses(found, freeaddrinfo);
}

void SetPort(sockaddr& address, int port) {
  const auto in_order = htons(static_cast<std::uint16_t>(port));
  if (address.sa_family == AF_INET6) {
    reinterpret_cast<sockaddr_in6&>(address).sin6_port = in_order;
  } else {
    reinterpret_cast<sockaddr_in&>(address).sin_port = in_order;
  }
}

int PortOf(int socket) {
  sockaddr_storage own = {};
  socklen_t size = sizeof own;
  if (getsockname(socket, reinterpret_cast<sockaddr*>(&own), &size) != 0) return 0;
  return ntohs(own.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(own).sin6_port
                                         : reinterpret_cast<sockaddr_in&>(own).sin_port);
}

/// Of an address that is listened on, how this machine reaches it.
std::string OwnAddress(const sockaddr& address, int port) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address.sa_family == AF_INET6) {
    in6_addr own = reinterpret_cast<const sockaddr_in6&>(address).sin6_addr;
    if (IN6_IS_ADDR_UNSPECIFIED(&own)) own = in6addr_loopback;
    inet_ntop(AF_INET6, &own, text.data(), text.size());
    return absl::StrCat("[", text.data(), "]:", port);
  }
  in_addr own = reinterpret_cast<const sockaddr_in&>(address).sin_addr;
  if (own.s_addr == INADDR_ANY) own.s_addr = htonl(INADDR_LOOPBACK);
  inet_ntop(AF_INET, &own, text.data(), text.size());
  return absl::StrCat(text.data(), ":", port);
}

template <typename Value>
void Set(int socket, int level, int name, Value value) {
  setsockopt(socket, level, name, &value, sizeof value);
}

/// A socket that listens there, or -1 with errno. What is set here holds for its connections, too.
int ListenOn(const addrinfo& at) {
  const int listener =
      socket(at.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, at.ai_protocol);
  if (listener < 0) return -1;
  Set(listener, SOL_SOCKET, SO_REUSEADDR, 1);
  Set(listener, IPPROTO_TCP, TCP_NODELAY, 1);
  Set(listener, IPPROTO_TCP, TCP_USER_TIMEOUT, kPeerTimeout_ms);
  if (at.ai_family == AF_INET6) {
    const bool is_any =
        IN6_IS_ADDR_UNSPECIFIED(&reinterpret_cast<const sockaddr_in6*>(at.ai_addr)->sin6_addr);
    Set(listener, IPPROTO_IPV6, IPV6_V6ONLY, is_any ? 0 : 1);
  }
  if (bind(listener, at.ai_addr, at.ai_addrlen) == 0 && listen(listener, kBacklog) == 0) {
    return listener;
  }
  const int error = errno;
  close(listener);
  errno = error;
  return -1;
}

}  // namespace

absl::StatusOr<ListenSockets> ListenAt(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  const std::string port = address.substr(colon + 1);
  // [::] takes IPv4, too, where the machine has both.
  std::vector<std::string> hosts = {host};
  if (host == "0.0.0.0") hosts = {"::", host};
  if (host == "::") hosts = {host, "0.0.0.0"};

  ListenSockets listening;
  std::string why = "it has no address";
  for (const std::string& name : hosts) {
    const auto found = Resolve(name, port);
    if (!found.ok()) {
      why = std::string(found.status().message());
      continue;
    }
    for (const addrinfo* at = found->get(); at != nullptr; at = at->ai_next) {
      if (listening.port != 0) SetPort(*at->ai_addr, listening.port);
      const int listener = ListenOn(*at);
      if (listener < 0) {
        why = std::strerror(errno);
        continue;
      }
      listening.sockets.push_back(listener);
      if (listening.port != 0) continue;
      listening.port = PortOf(listener);
      listening.own_address = OwnAddress(*at->ai_addr, listening.port);
    }
    if (!listening.sockets.empty()) return listening;
  }
  return absl::UnavailableError(
      absl::StrCat("cannot listen on ", address, ": ", why,
                   "; is the host one of this machine's, and is the port free and allowed?"));
}

}  // namespace scanloc::server
