#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

/// HTTP/2 by hand, to do what no gRPC client does.
namespace scanloc::test {

/// A TCP connection without any protocol.
class Socket {
 public:
  explicit Socket(const std::string& address) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in peer = {};
    peer.sin_family = AF_INET;
    peer.sin_port =
        htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    peer.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(fd_, reinterpret_cast<const sockaddr*>(&peer), sizeof(peer)) != 0) {
      throw std::runtime_error("cannot connect to " + address);
    }
    // Only a test that fails waits so long.
    const timeval patience = {.tv_sec = 60, .tv_usec = 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
  }
  ~Socket() { close(fd_); }
  Socket(Socket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Socket(const Socket&) = delete;

  /// The server may hang up meanwhile.
  void Send(const std::string& bytes) const {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const ssize_t count = send(fd_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return;
      sent += static_cast<std::size_t>(count);
    }
  }

  /// Exactly so many bytes; fewer if the server hangs up.
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

  /// Ends with a reset instead of a goodbye.
  void Reset() const {
    const linger hard = {.l_onoff = 1, .l_linger = 0};
    setsockopt(fd_, SOL_SOCKET, SO_LINGER, &hard, sizeof(hard));
  }

 private:
  int fd_;
};

inline std::string BigEndian(std::uint64_t value, int num_bytes) {
  std::string bytes;
  for (int shift = 8 * (num_bytes - 1); shift >= 0; shift -= 8) {
    bytes += static_cast<char>(value >> shift);
  }
  return bytes;
}

inline std::string Frame(char type, char flags, std::uint32_t stream, const std::string& payload,
                         std::size_t announced) {
  return BigEndian(announced, 3) + type + flags + BigEndian(stream, 4) + payload;
}
inline std::string Frame(char type, char flags, std::uint32_t stream, const std::string& payload) {
  return Frame(type, flags, stream, payload, payload.size());
}

/// The headers of a call, up to its message; with a bearer token if it is not empty.
inline std::string CallHeaders(std::uint32_t stream, const std::string& path,
                               const std::string& token = "", const std::string& encoding = "") {
  const auto literal = [](const std::string& name, const std::string& value) {
    return std::string(1, '\0') + static_cast<char>(name.size()) + name +
           static_cast<char>(value.size()) + value;
  };
  std::string headers = literal(":method", "POST") + literal(":scheme", "http") +
                        literal(":path", path) + literal(":authority", "localhost") +
                        literal("te", "trailers") + literal("content-type", "application/grpc");
  if (!token.empty()) headers += literal("authorization", "Bearer " + token);
  if (!encoding.empty()) headers += literal("grpc-encoding", encoding);
  return Frame(1, 4, stream, headers);
}

/// The opening of a connection; the client's streams may be sent so much, unread.
inline std::string Opening(std::uint32_t window_bytes = 65535) {
  return "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" +
         Frame(4, 0, 0, BigEndian(4, 2) + BigEndian(window_bytes, 4));
}

/// A message of which so much is announced, and this is sent.
inline std::string Message(std::size_t announced, const std::string& sent) {
  return std::string(1, '\0') + BigEndian(announced, 4) + sent;
}

/// A connection that keeps to the protocol as far as the test wants.
class RawHttp2 {
 public:
  explicit RawHttp2(const std::string& address, std::uint32_t window_bytes = 65535)
      : socket_(address) {
    socket_.Send(Opening(window_bytes));
  }

  /// The number of the call's stream.
  std::uint32_t Call(const std::string& path, const std::string& token = "",
                     const std::string& encoding = "") {
    const std::uint32_t stream = next_stream_;
    next_stream_ += 2;
    streams_[stream] = {.window = initial_window_, .is_ended = false};
    socket_.Send(CallHeaders(stream, path, token, encoding));
    return stream;
  }

  /// Sends as the server lets it; false if it ended the call.
  bool Send(std::uint32_t stream, const std::string& bytes) {
    constexpr std::size_t kMaxFrameBytes = 16384;
    std::size_t sent = 0;
    while (sent < bytes.size()) {
      const std::int64_t allowed = std::min(window_, streams_[stream].window);
      if (is_over(stream)) return false;
      if (allowed <= 0) {
        Take();
        continue;
      }
      const std::size_t count =
          std::min({kMaxFrameBytes, bytes.size() - sent, static_cast<std::size_t>(allowed)});
      socket_.Send(Frame(0, 0, stream, bytes.substr(sent, count)));
      sent += count;
      window_ -= static_cast<std::int64_t>(count);
      streams_[stream].window -= static_cast<std::int64_t>(count);
    }
    return true;
  }

  void Ping() const { socket_.Send(Frame(6, 0, 0, std::string(8, 'p'))); }

  /// Waits until the server ends the call.
  void AwaitEnd(std::uint32_t stream) {
    while (!is_over(stream)) Take();
  }

  /// Waits until the server sends the call something.
  void AwaitHeaders(std::uint32_t stream) {
    while (!is_over(stream) && !streams_[stream].has_headers) Take();
  }

  /// Answers what the server asks until it hangs up.
  void AwaitClose() {
    while (!is_closed_) Take();
  }

  /// Waits until the server says that it will have no more of this; what it says.
  std::string AwaitGoAway() {
    while (!is_closed_ && go_away_.empty()) Take();
    return go_away_;
  }

 private:
  struct Stream {
    std::int64_t window = 0;
    bool is_ended = false;
    bool has_headers = false;
  };

  [[nodiscard]] bool is_over(std::uint32_t stream) {
    return is_closed_ || streams_[stream].is_ended;
  }

  static std::uint32_t Number(const std::string& bytes, std::size_t at, std::size_t count) {
    std::uint32_t number = 0;
    for (std::size_t i = at; i < at + count; ++i) {
      number = number << 8 | static_cast<unsigned char>(bytes[i]);
    }
    return number;
  }

  /// Takes in one frame.
  void Take() {
    const std::string header = socket_.Read(9);
    if (header.size() < 9) {
      is_closed_ = true;
      return;
    }
    const std::string payload = socket_.Read(Number(header, 0, 3));
    const char flags = header[4];
    const std::uint32_t stream = Number(header, 5, 4);
    switch (header[3]) {
      case 1:  // HEADERS
        streams_[stream].has_headers = true;
        if ((flags & 1) != 0) streams_[stream].is_ended = true;
        break;
      case 3:  // RST_STREAM
        streams_[stream].is_ended = true;
        break;
      case 4:  // SETTINGS
        if ((flags & 1) == 0) TakeSettings(payload);
        break;
      case 6:  // PING
        if ((flags & 1) == 0) socket_.Send(Frame(6, 1, 0, payload));
        break;
      case 7:  // GOAWAY: last stream, error code, why
        go_away_ = payload.substr(8);
        break;
      case 8:  // WINDOW_UPDATE
        (stream == 0 ? window_ : streams_[stream].window) += Number(payload, 0, 4);
        break;
      default:
        break;
    }
  }

  void TakeSettings(const std::string& payload) {
    for (std::size_t at = 0; at + 6 <= payload.size(); at += 6) {
      if (Number(payload, at, 2) != 4) continue;  // only the window matters here
      const std::int64_t initial = Number(payload, at + 2, 4);
      for (auto& [number, stream] : streams_) stream.window += initial - initial_window_;
      initial_window_ = initial;
    }
    socket_.Send(Frame(4, 1, 0, ""));
  }

  Socket socket_;
  std::uint32_t next_stream_ = 1;
  std::int64_t window_ = 65535;
  std::int64_t initial_window_ = 65535;
  std::map<std::uint32_t, Stream> streams_;
  bool is_closed_ = false;
  std::string go_away_;
};

}  // namespace scanloc::test
