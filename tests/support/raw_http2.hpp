#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>

#include "support/http2.hpp"
#include "support/tcp_connection.hpp"

namespace scanloc::test {

/// A connection that keeps to the protocol as far as the test wants.
class RawHttp2 {
 public:
  explicit RawHttp2(const std::string& address, std::uint32_t window_bytes = 65535)
      : socket_(address) {
    socket_.Send(Http2Opening(window_bytes));
  }

  /// The number of the call's stream.
  std::uint32_t Call(const std::string& path, const std::string& token = "",
                     const std::string& encoding = "") {
    const std::uint32_t stream = next_stream_;
    next_stream_ += 2;
    streams_[stream] = {.window = initial_window_, .is_ended = false};
    socket_.Send(Http2CallHeaders(stream, path, token, encoding));
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
      socket_.Send(Http2Frame(0, 0, stream, bytes.substr(sent, count)));
      sent += count;
      window_ -= static_cast<std::int64_t>(count);
      streams_[stream].window -= static_cast<std::int64_t>(count);
    }
    return true;
  }

  void Ping() const { socket_.Send(Http2Frame(6, 0, 0, std::string(8, 'p'))); }

  /// Waits until the server ends the call.
  void AwaitEnd(std::uint32_t stream) {
    while (!is_over(stream)) Take();
  }

  /// Waits until the server sends the call something.
  void AwaitHeaders(std::uint32_t stream) {
    while (!is_over(stream) && !streams_[stream].has_headers) Take();
  }

  /// Whether the call was sent a message.
  [[nodiscard]] bool HasMessage(std::uint32_t stream) const {
    const auto found = streams_.find(stream);
    return found != streams_.end() && found->second.has_message;
  }
  [[nodiscard]] bool is_closed() const { return is_closed_; }

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
    bool has_message = false;
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
      case 0:  // DATA
        streams_[stream].has_message = true;
        break;
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
        if ((flags & 1) == 0) socket_.Send(Http2Frame(6, 1, 0, payload));
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
    socket_.Send(Http2Frame(4, 1, 0, ""));
  }

  TcpConnection socket_;
  std::uint32_t next_stream_ = 1;
  std::int64_t window_ = 65535;
  std::int64_t initial_window_ = 65535;
  std::map<std::uint32_t, Stream> streams_;
  bool is_closed_ = false;
  std::string go_away_;
};

}  // namespace scanloc::test
