#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace scanloc::test {

/// A TCP connection without any protocol; closed at the end.
class TcpConnection {
 public:
  /// Throws if nobody listens at the address, IPv4:PORT. `from`: an address of this machine's.
  explicit TcpConnection(const std::string& address, const char* from = nullptr)
      : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    if (from != nullptr) {
      sockaddr_in own = {};
      own.sin_family = AF_INET;
      inet_pton(AF_INET, from, &own.sin_addr);
      bind(fd_, reinterpret_cast<sockaddr*>(&own), sizeof own);
    }
    const std::size_t colon = address.rfind(':');
    sockaddr_in to = {};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
    inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr);
    if (connect(fd_, reinterpret_cast<sockaddr*>(&to), sizeof to) != 0) {
      close(fd_);
      throw std::runtime_error("cannot connect to " + address);
    }
    SetPatience(std::chrono::seconds(60));  // only a test that fails waits so long
  }
  ~TcpConnection() {
    if (fd_ >= 0) close(fd_);
  }
  TcpConnection(TcpConnection&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  TcpConnection(const TcpConnection&) = delete;
  TcpConnection& operator=(const TcpConnection&) = delete;

  /// How long to wait for the other side.
  void SetPatience(std::chrono::microseconds time) const {
    constexpr int kPerSecond = 1'000'000;
    const timeval patience = {.tv_sec = time.count() / kPerSecond,
                              .tv_usec = time.count() % kPerSecond};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  }

  /// The other side may have hung up: then there is nobody to send to.
  void Send(const std::string& bytes) const {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const ssize_t count = send(fd_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return;
      sent += static_cast<std::size_t>(count);
    }
  }

  /// As much as the other side takes in before patience ends; none if it has hung up.
  [[nodiscard]] std::optional<std::size_t> SendSome(const std::string& bytes) const {
    const ssize_t count = send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count >= 0) return static_cast<std::size_t>(count);
    if (errno == EAGAIN || errno == EWOULDBLOCK) return 0;
    return {};
  }

  /// Throws away what has come.
  void Discard() const {
    char buffer[65536];
    while (recv(fd_, buffer, sizeof buffer, MSG_DONTWAIT) > 0) {
    }
  }

  /// Exactly so many bytes; fewer if the other side hangs up.
  [[nodiscard]] std::string Read(std::size_t num_bytes) const {
    std::string bytes(num_bytes, '\0');
    std::size_t got = 0;
    while (got < num_bytes) {
      const ssize_t count = recv(fd_, bytes.data() + got, num_bytes - got, 0);
      if (count <= 0) break;
      got += static_cast<std::size_t>(count);
    }
    bytes.resize(got);
    return bytes;
  }

  /// All that comes until the other side hangs up.
  [[nodiscard]] std::string ReadAll() const {
    std::string all;
    char buffer[4096];
    for (ssize_t count = 0; (count = read(fd_, buffer, sizeof buffer)) > 0;) {
      all.append(buffer, static_cast<std::size_t>(count));
    }
    return all;
  }

  /// The other side has not hung up, and has sent nothing that was not read.
  [[nodiscard]] bool IsOpen() const {
    char byte = 0;
    return recv(fd_, &byte, 1, MSG_PEEK | MSG_DONTWAIT) < 0 && errno == EAGAIN;
  }

  /// Whether something came before the other side hung up. Waits for either.
  [[nodiscard]] bool AwaitSomething() const {
    char byte = 0;
    return recv(fd_, &byte, 1, MSG_PEEK) == 1;
  }

  /// Closing will be a reset instead of a goodbye.
  void ResetAtEnd() const {
    const linger hard = {.l_onoff = 1, .l_linger = 0};
    setsockopt(fd_, SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
  }

 private:
  int fd_;
};

/// What an HTTP server answers, headers included.
inline std::string HttpGet(const std::string& address, const std::string& path) {
  const TcpConnection connection(address);
  connection.Send("GET " + path + " HTTP/1.0\r\n\r\n");
  return connection.ReadAll();
}

}  // namespace scanloc::test
