#include "front/listener.hpp"

#include <fcntl.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <spdlog/spdlog.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"
#include "front/listen_sockets.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::server {
namespace {

/// For all else: maps that load, the log, the metrics' readers.
constexpr int kOwnDescriptors = 96;
/// gRPC's own, and the listener's.
constexpr int kDescriptorsPerConnection = 2;
constexpr int kMinConnections = 16;

/// After a failure for want of descriptors or memory.
constexpr std::chrono::milliseconds kPause(50);
constexpr std::size_t kMaxAtOnce = 64;
/// Of the eldest connections of an address so many are looked at for one that has long been silent.
constexpr int kMaxLookedAt = 32;

/// An address, as a client: of IPv6 the part that one network gets.
std::string PeerOf(const sockaddr_storage& address) {
  const auto bytes = [](const auto& from, std::size_t count) {
    return std::string(reinterpret_cast<const char*>(&from), count);
  };
  if (address.ss_family == AF_INET) {
    return bytes(reinterpret_cast<const sockaddr_in&>(address).sin_addr, sizeof(in_addr));
  }
  const in6_addr& v6 = reinterpret_cast<const sockaddr_in6&>(address).sin6_addr;
  if (IN6_IS_ADDR_V4MAPPED(&v6)) return bytes(v6.s6_addr[12], sizeof(in_addr));
  return bytes(v6, sizeof v6 / 2);
}

/// What the system knows of a connection; nothing if it is not one any more.
tcp_info InfoOf(int socket) {
  tcp_info info = {};
  socklen_t size = sizeof info;
  if (getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return {};
  return info;
}

/// Ends a connection at once. Unlike shutdown(), which leaves what has come to be read, however
/// much work that is.
void Cut(int socket) {
  sockaddr nobody = {};
  nobody.sa_family = AF_UNSPEC;
  connect(socket, &nobody, sizeof nobody);
}

}  // namespace

absl::Status RaiseDescriptorLimit() {
  constexpr rlim_t kLeast = kOwnDescriptors + kDescriptorsPerConnection * kMinConnections;
  rlimit limit = {};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return absl::OkStatus();
  const rlim_t before = std::exchange(limit.rlim_cur, limit.rlim_max);
  if (before != limit.rlim_max && setrlimit(RLIMIT_NOFILE, &limit) != 0) {
    spdlog::warn("cannot raise the number of open files: {}", std::strerror(errno));
    limit.rlim_cur = before;
  }
  if (limit.rlim_cur >= kLeast) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("only ", limit.rlim_cur, " files and connections may be open at once, and ",
                   kLeast, " are needed: raise the limit (ulimit -n, LimitNOFILE)"));
}

int MaxConnections(std::int64_t max_memory_bytes) {
  rlimit limit = {};
  std::int64_t most = max_memory_bytes / kBytesPerConnection;
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
    const auto descriptors = static_cast<std::int64_t>(std::min<rlim_t>(limit.rlim_cur, 1U << 30));
    most = std::min(most, (descriptors - kOwnDescriptors) / kDescriptorsPerConnection);
  }
  return static_cast<int>(std::clamp<std::int64_t>(most, kMinConnections, 1 << 30));
}

absl::StatusOr<std::unique_ptr<Listener>> Listener::Open(const std::string& listen,
                                                         int max_connections) {
  ASSIGN_OR_RETURN(auto listening, ListenAt(listen));
  auto listener = std::unique_ptr<Listener>(
      new Listener(std::move(listening.sockets),
                   absl::StrCat(listen.substr(0, listen.rfind(':')), ":", listening.port),
                   listening.own_address, max_connections));
  if (listener->epoll_ < 0 || listener->wake_ < 0) {
    return absl::UnavailableError(
        absl::StrCat("cannot listen on ", listen, ": ", std::strerror(errno)));
  }
  epoll_event wake = {.events = EPOLLIN, .data = {.ptr = nullptr}};
  epoll_ctl(listener->epoll_, EPOLL_CTL_ADD, listener->wake_, &wake);
  listener->thread_ = std::thread([own = listener.get()] { own->Run(); });
  return listener;
}

Listener::Listener(std::vector<int> sockets, std::string address, std::string own_address,
                   int max_connections)
    : address_(std::move(address)),
      own_address_(std::move(own_address)),
      max_connections_(max_connections),
      sockets_(std::move(sockets)),
      epoll_(epoll_create1(EPOLL_CLOEXEC)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

Listener::~Listener() {
  HangUp();
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  eventfd_write(wake_, 1);
  if (thread_.joinable()) thread_.join();
  for (auto& [peer, connections] : connections_) {
    for (const Connection& connection : connections) close(connection.socket);
  }
  for (const int socket : sockets_) close(socket);
  if (wake_ >= 0) close(wake_);
  if (epoll_ >= 0) close(epoll_);
}

void Listener::LetIn(Take take) {
  const std::lock_guard lock(mutex_);
  take_ = std::move(take);
  Listen(true);
}

void Listener::HangUp() {
  const std::lock_guard lock(mutex_);
  take_ = nullptr;
  Listen(false);
  HangUpIf([](const Connection&) { return true; });
}

void Listener::Close(std::chrono::nanoseconds silence, std::chrono::nanoseconds latest) {
  const std::lock_guard lock(mutex_);
  take_ = nullptr;
  Listen(false);
  for (const int socket : std::exchange(sockets_, {})) close(socket);
  for (auto& [peer, connections] : connections_) {
    for (Connection& connection : connections) {
      connection.num_bytes_at_close = InfoOf(connection.socket).tcpi_bytes_received;
    }
  }
  silent_end_ = Clock::now() + silence;
  all_end_ = Clock::now() + latest;
  eventfd_write(wake_, 1);
}

void Listener::HangUpWhoIsLeft() {
  const auto now = Clock::now();
  if (now >= silent_end_) {
    HangUpIf([](const Connection& connection) {
      return InfoOf(connection.socket).tcpi_bytes_received == connection.num_bytes_at_close;
    });
    silent_end_ = Clock::time_point::max();
  }
  if (now >= all_end_) {
    HangUpIf([](const Connection&) { return true; });
    all_end_ = Clock::time_point::max();
  }
}

template <typename Condition>
void Listener::HangUpIf(const Condition& condition) {
  for (const auto& [peer, connections] : connections_) {
    for (const Connection& connection : connections) {
      if (condition(connection)) Cut(connection.socket);
    }
  }
}

int Listener::num_connections() const {
  const std::lock_guard lock(mutex_);
  return num_connections_;
}

std::int64_t Listener::num_bytes_received() const {
  const std::lock_guard lock(mutex_);
  std::uint64_t num_bytes = 0;
  for (const auto& [peer, connections] : connections_) {
    for (const Connection& connection : connections) {
      num_bytes += InfoOf(connection.socket).tcpi_bytes_received;
    }
  }
  return static_cast<std::int64_t>(num_bytes);
}

void Listener::Listen(bool shall) {
  is_pausing_ = false;
  if (shall == is_listening_) return;
  is_listening_ = shall;
  for (const int socket : sockets_) {
    epoll_event event = {.events = EPOLLIN, .data = {.ptr = nullptr}};
    epoll_ctl(epoll_, shall ? EPOLL_CTL_ADD : EPOLL_CTL_DEL, socket, &event);
  }
}

void Listener::Run() {
  std::array<epoll_event, 256> events{};
  int patience_ms = -1;
  while (true) {
    const int count =
        epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), patience_ms);
    const std::lock_guard lock(mutex_);
    if (is_ending_) return;
    eventfd_t woken = 0;
    eventfd_read(wake_, &woken);
    for (int i = 0; i < count; ++i) {
      if (auto* connection = static_cast<Connection*>(events[i].data.ptr)) Forget(*connection);
    }
    HangUpWhoIsLeft();
    if (is_pausing_ && Clock::now() >= pause_end_) Listen(take_ != nullptr);
    if (is_listening_) {
      for (const int socket : sockets_) Accept(socket);
    }
    patience_ms = Patience_ms();
  }
}

int Listener::Patience_ms() const {
  Clock::time_point next = std::min(silent_end_, all_end_);
  if (is_pausing_) next = std::min(next, pause_end_);
  if (next == Clock::time_point::max()) return -1;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(next - Clock::now());
  return static_cast<int>(std::clamp<std::int64_t>(left.count(), 0, 60'000));
}

void Listener::Accept(int listening) {
  for (std::size_t i = 0; i < kMaxAtOnce && is_listening_; ++i) {
    sockaddr_storage from = {};
    socklen_t size = sizeof from;
    const int socket =
        accept4(listening, reinterpret_cast<sockaddr*>(&from), &size, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (socket >= 0) {
      Add(socket, PeerOf(from));
    } else if (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS) {
      MakeRoomFor("");
      Listen(false);
      is_pausing_ = true;
      pause_end_ = Clock::now() + kPause;
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      return;
    }  // else the peer was gone before it was let in
  }
}

void Listener::Add(int socket, const std::string& peer) {
  if (num_connections_ >= max_connections_) MakeRoomFor(peer);
  const int own = fcntl(socket, F_DUPFD_CLOEXEC, 0);
  if (own < 0) {
    close(socket);
    return;
  }
  Connection* added = nullptr;
  try {
    const auto home = connections_.try_emplace(peer).first;
    const auto self = home->second.insert(home->second.end(), {.socket = own, .home = home});
    self->self = self;
    added = &*self;
  } catch (const std::bad_alloc&) {
    close(own);
    close(socket);
    return;
  }
  ++num_connections_;
  epoll_event end = {.events = 0, .data = {.ptr = added}};  // the end is told of in any case
  epoll_ctl(epoll_, EPOLL_CTL_ADD, own, &end);
  take_(socket);
}

void Listener::MakeRoomFor(const std::string& peer) {
  const auto most = std::ranges::max_element(connections_, [&](const auto& a, const auto& b) {
    // With the one that wants in.
    const auto size = [&](const auto& of) { return of.second.size() + (of.first == peer); };
    return size(a) < size(b);
  });
  if (most == connections_.end()) return;
  Connection* silentest = nullptr;
  std::int64_t longest = -1;
  int num_looked_at = 0;
  for (Connection& connection : most->second) {
    if (++num_looked_at > kMaxLookedAt) break;
    const std::int64_t silence = InfoOf(connection.socket).tcpi_last_data_recv;
    if (silence <= longest) continue;
    longest = silence;
    silentest = &connection;
  }
  Cut(silentest->socket);
  Forget(*silentest);
}

void Listener::Forget(Connection& connection) {
  // Closing alone would not take it off the watch while the other descriptor is open.
  epoll_ctl(epoll_, EPOLL_CTL_DEL, connection.socket, nullptr);
  close(connection.socket);
  const Peers::iterator home = connection.home;
  home->second.erase(connection.self);
  if (home->second.empty()) connections_.erase(home);
  --num_connections_;
}

}  // namespace scanloc::server
