#include <arpa/inet.h>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "http_server.hpp"

namespace scanloc::web {

absl::StatusOr<std::pair<std::string, std::uint16_t>> ParseAddress(const std::string& listen) {
  const std::size_t colon = listen.rfind(':');
  int port = -1;
  std::string host = listen.substr(0, colon == std::string::npos ? 0 : colon);
  if (host.empty() || !absl::SimpleAtoi(listen.substr(colon + 1), &port) || port < 0 ||
      port > 65535) {
    return absl::InvalidArgumentError(
        absl::StrCat("listen is \"", listen, "\"; it must be HOST:PORT with a port in [0, 65535]"));
  }
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  return std::pair(host, static_cast<std::uint16_t>(port));
}

bool IsLoopback(const std::string& host) {
  if (host == "localhost" || host == "::1") return true;
  in_addr address = {};
  return inet_pton(AF_INET, host.c_str(), &address) == 1 && ntohl(address.s_addr) >> 24 == 127;
}

std::optional<std::string> Request::Parameter(std::string_view name) const {
  for (const auto& [key, value] : parameters) {
    if (key == name) return value;
  }
  return std::nullopt;
}

}  // namespace scanloc::web
