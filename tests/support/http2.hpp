#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

/// HTTP/2 and gRPC's messages by hand, for clients that do not keep to them.
namespace scanloc::test {

inline std::string BigEndian(std::uint64_t value, int num_bytes) {
  std::string bytes;
  for (int shift = 8 * (num_bytes - 1); shift >= 0; shift -= 8) {
    bytes += static_cast<char>(value >> shift);
  }
  return bytes;
}

/// A frame that announces so many bytes of payload, whatever it has.
inline std::string Http2Frame(char type, char flags, std::uint32_t stream,
                              const std::string& payload, std::size_t announced) {
  return BigEndian(announced, 3) + type + flags + BigEndian(stream, 4) + payload;
}
inline std::string Http2Frame(char type, char flags, std::uint32_t stream,
                              const std::string& payload) {
  return Http2Frame(type, flags, stream, payload, payload.size());
}

/// The opening of a connection; the client's streams may be sent so much, unread.
inline std::string Http2Opening(std::uint32_t window_bytes = 65535) {
  return "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" +
         Http2Frame(4, 0, 0, BigEndian(4, 2) + BigEndian(window_bytes, 4));
}

/// The length of a text in a block of headers (RFC 7541, 5.1: seven bits, then seven at a time).
inline std::string HpackLength(std::size_t length) {
  if (length < 127) return {static_cast<char>(length)};
  std::string bytes = "\x7f";
  for (length -= 127; length >= 128; length /= 128) bytes += static_cast<char>(length % 128 + 128);
  return bytes + static_cast<char>(length);
}

inline std::string Http2SettingsAck() { return Http2Frame(4, 1, 0, ""); }

/// The headers of a call, up to its message; with a bearer token if it is not empty.
inline std::string Http2CallHeaders(std::uint32_t stream, const std::string& path,
                                    const std::string& token = "",
                                    const std::string& encoding = "") {
  const auto literal = [](const std::string& name, const std::string& value) {
    return std::string(1, '\0') + HpackLength(name.size()) + name + HpackLength(value.size()) +
           value;
  };
  std::string headers = literal(":method", "POST") + literal(":scheme", "http") +
                        literal(":path", path) + literal(":authority", "localhost") +
                        literal("te", "trailers") + literal("content-type", "application/grpc");
  if (!token.empty()) headers += literal("authorization", "Bearer " + token);
  if (!encoding.empty()) headers += literal("grpc-encoding", encoding);
  return Http2Frame(1, 4, stream, headers);
}

/// The opening of a connection with a call of a method, up to its message.
inline std::string Http2CallOpening(const std::string& path, const std::string& token = "") {
  return Http2Opening() + Http2CallHeaders(1, path, token);
}

/// A message of gRPC of which so much is announced, and this is sent.
inline std::string GrpcMessage(std::size_t announced, const std::string& sent,
                               bool is_compressed = false) {
  return std::string(1, is_compressed ? '\1' : '\0') + BigEndian(announced, 4) + sent;
}

/// A message of gRPC as the only call's next data.
inline std::string Http2Message(const std::string& message, bool is_compressed = false) {
  return Http2Frame(0, 0, 1, GrpcMessage(message.size(), message, is_compressed));
}

}  // namespace scanloc::test
