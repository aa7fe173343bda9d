#include "call_metadata.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::client {
namespace {

constexpr std::size_t kMaxRequestIdBytes = 128;

bool IsThisMachine(const std::string& address) {
  const std::string host = address.substr(0, address.rfind(':'));
  if (host == "localhost" || host == "[::1]") return true;
  in_addr number = {};
  return inet_pton(AF_INET, host.c_str(), &number) == 1 && ntohl(number.s_addr) >> 24 == 127;
}

/// Printable, without spaces, as metadata are.
bool IsOneWord(const std::string& text) {
  return std::ranges::all_of(text, [](unsigned char c) { return std::isgraph(c) != 0; });
}

bool IsUtf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t num_bytes = FirstUtf8Character(text).num_bytes;
    if (num_bytes == 0) return false;
    text.remove_prefix(num_bytes);
  }
  return true;
}

}  // namespace

absl::Status CheckToken(const ClientOptions& options) {
  if (options.token.empty()) return absl::OkStatus();
  if (!IsOneWord(options.token)) {
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

absl::Status CheckRequestId(const std::string& id) {
  if (id.size() <= kMaxRequestIdBytes && IsOneWord(id)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("request_id is not at most ", kMaxRequestIdBytes,
                                                 " printable characters without spaces"));
}

void SendRequestId(const std::string& id, grpc::ClientContext& context) {
  if (!id.empty()) context.AddMetadata("x-request-id", id);
}

void SendMapName(const std::string& map, grpc::ClientContext& context) {
  // What is no name of a map is for the server to refuse.
  const bool is_name = !map.empty() && map.size() <= limits::kMaxNameBytes && IsOneWord(map);
  if (is_name) context.AddMetadata("scanloc-map", map);
}

absl::Status CheckTexts(const google::protobuf::Message& request) {
  using google::protobuf::FieldDescriptor;
  const google::protobuf::Reflection& reflection = *request.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(request, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->is_repeated()) continue;  // none holds texts
    if (field->type() == FieldDescriptor::TYPE_STRING) {
      const std::string text = reflection.GetString(request, field);
      if (IsUtf8(text)) continue;
      return absl::InvalidArgumentError(absl::StrCat(field->name(), " is \"", Printable(text),
                                                     "\", which is not UTF-8 text; rename it"));
    }
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    RETURN_IF_ERROR(CheckTexts(reflection.GetMessage(request, field)));
  }
  return absl::OkStatus();
}

}  // namespace scanloc::client
