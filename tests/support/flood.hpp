#pragma once

#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/http2.hpp"
#include "support/tcp_connection.hpp"

namespace scanloc::test {

/// What a hostile client sends on a connection, over and over.
struct Flood {
  std::string opening;
  /// The next bytes; `stream` is a number that no call of the connection had, and goes up by 2 for
  /// every round.
  std::function<std::string(std::uint32_t stream)> round;
  bool reads = true;  ///< takes in what the server sends, and throws it away
};

/// Floods a server from so many connections at once until it is told to stop; a connection that the
/// server ends is opened again.
class Flooders {
 public:
  Flooders(const std::string& address, const Flood& flood, int num_connections) {
    for (int i = 0; i < num_connections; ++i) {
      threads_.emplace_back([this, address, flood] {
        while (!stopping_) Run(address, flood);
      });
    }
  }
  ~Flooders() { Stop(); }
  Flooders(const Flooders&) = delete;
  Flooders& operator=(const Flooders&) = delete;

  void Stop() {
    stopping_ = true;
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }

 private:
  /// One connection.
  void Run(const std::string& address, const Flood& flood) {
    std::optional<TcpConnection> connection;
    try {
      connection.emplace(address);
    } catch (const std::runtime_error&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));  // as a client would
      return;
    }
    connection->SetPatience(std::chrono::milliseconds(50));
    std::string bytes = flood.opening;
    std::uint32_t stream = 1;
    while (!stopping_ && stream < 0x7fff'0000U) {
      constexpr std::size_t kBlockBytes = 65536;
      while (bytes.size() < kBlockBytes) {
        bytes += flood.round(stream);
        stream += 2;
      }
      const std::optional<std::size_t> sent = connection->SendSome(bytes);
      if (!sent) return;
      bytes.erase(0, *sent);
      if (flood.reads) connection->Discard();
    }
  }

  std::atomic<bool> stopping_ = false;
  std::vector<std::thread> threads_;
};

inline std::string Http2Reset(std::uint32_t stream) {
  return Http2Frame(3, 0, stream, BigEndian(8, 4));  // CANCEL
}

/// Calls that are taken back at once.
inline Flood RapidReset(const std::string& path) {
  return {.opening = Http2Opening() + Http2SettingsAck(), .round = [path](std::uint32_t stream) {
            return Http2CallHeaders(stream, path) + Http2Reset(stream);
          }};
}

/// Whole calls with an empty message, taken back at once.
inline Flood ResetAfterMessage(const std::string& path) {
  return {.opening = Http2Opening() + Http2SettingsAck(), .round = [path](std::uint32_t stream) {
            return Http2CallHeaders(stream, path) + Http2Frame(0, 1, stream, GrpcMessage(0, "")) +
                   Http2Reset(stream);
          }};
}

/// Whole calls, however many may be open at once: the server's settings are never acknowledged.
inline Flood CallsWithoutSettings(const std::string& path) {
  return {.opening = Http2Opening(),
          .round = [path](std::uint32_t stream) { return Http2CallHeaders(stream, path); }};
}

/// Headers that never end.
inline Flood EndlessHeaders(const std::string& path) {
  const std::string call = Http2CallHeaders(1, path);
  const std::string without_end = Http2Frame(1, 0, 1, call.substr(9));
  std::string header =
      std::string(1, '\0') + '\x04' + "x-aa" + '\x7f' + '\x00' + std::string(127, 'a');
  std::string many;
  for (int i = 0; i < 100; ++i) many += header;
  const std::string more = Http2Frame(9, 0, 1, many);
  return {.opening = Http2Opening() + Http2SettingsAck() + without_end,
          .round = [more](std::uint32_t) { return more; }};
}

/// Settings of the client's own, each of which the server has to acknowledge, to nobody who reads.
inline Flood EndlessSettings() {
  return {.opening = Http2Opening() + Http2SettingsAck(),
          .round = [](std::uint32_t) { return Http2Frame(4, 0, 0, ""); },
          .reads = false};
}

/// Pings, whose answers nobody reads.
inline Flood EndlessPings() {
  return {.opening = Http2Opening() + Http2SettingsAck(),
          .round = [](std::uint32_t) { return Http2Frame(6, 0, 0, std::string(8, 'p')); },
          .reads = false};
}

}  // namespace scanloc::test
