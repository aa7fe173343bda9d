#include "token.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <cctype>
#include <string>

#include "absl/strings/str_cat.h"

namespace scanloc::client {
namespace {

bool IsThisMachine(const std::string& address) {
  const std::string host = address.substr(0, address.rfind(':'));
  if (host == "localhost" || host == "[::1]") return true;
  in_addr number = {};
  return inet_pton(AF_INET, host.c_str(), &number) == 1 && ntohl(number.s_addr) >> 24 == 127;
}

}  // namespace

absl::Status CheckToken(const ClientOptions& options) {
  if (options.token.empty()) return absl::OkStatus();
  if (!std::ranges::all_of(options.token, [](unsigned char c) { return std::isgraph(c) != 0; })) {
    return absl::InvalidArgumentError("token has a character that is not printable, or a space");
  }
  if (options.tls_ca_file.empty() && !options.allow_plaintext_token &&
      !IsThisMachine(options.address)) {
    return absl::InvalidArgumentError(
        absl::StrCat("the token would be sent unencrypted to ", options.address,
                     "; give tls_ca_file, or say allow_plaintext_token"));
  }
  return absl::OkStatus();
}

void ShowToken(const ClientOptions& options, grpc::ClientContext& context) {
  if (!options.token.empty()) {
    context.AddMetadata("authorization", absl::StrCat("Bearer ", options.token));
  }
}

}  // namespace scanloc::client
