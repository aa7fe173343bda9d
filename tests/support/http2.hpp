#pragma once

#include <cstddef>
#include <string>

/// HTTP/2 by hand, for clients that do not keep to it.
namespace scanloc::test {

/// A frame that announces so many bytes of payload, whatever it has.
inline std::string Http2Frame(char type, char flags, int stream, const std::string& payload,
                              std::size_t announced) {
  std::string frame;
  for (const int shift : {16, 8, 0}) frame += static_cast<char>(announced >> shift);
  frame += type;
  frame += flags;
  for (const int shift : {24, 16, 8, 0}) frame += static_cast<char>(stream >> shift);
  return frame + payload;
}

/// The opening of a connection with a call of a method, up to its message.
inline std::string Http2CallOpening(const std::string& method, const std::string& token = "") {
  const auto literal = [](const std::string& name, const std::string& value) {
    return std::string(1, '\0') + static_cast<char>(name.size()) + name +
           static_cast<char>(value.size()) + value;
  };
  std::string headers = literal(":method", "POST") + literal(":scheme", "http") +
                        literal(":path", method) + literal(":authority", "localhost") +
                        literal("te", "trailers") + literal("content-type", "application/grpc");
  if (!token.empty()) headers += literal("authorization", "Bearer " + token);
  return "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + Http2Frame(4, 0, 0, "", 0) +
         Http2Frame(1, 4, 1, headers, headers.size());
}

/// A message of gRPC as the only call's next data.
inline std::string Http2Message(const std::string& message, bool is_compressed = false) {
  std::string data(1, is_compressed ? '\1' : '\0');
  for (const int shift : {24, 16, 8, 0}) data += static_cast<char>(message.size() >> shift);
  data += message;
  return Http2Frame(0, 0, 1, data, data.size());
}

}  // namespace scanloc::test
