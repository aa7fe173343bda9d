#include "request_id.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>

#include "absl/strings/str_cat.h"
#include "scanloc/core/limits.hpp"

namespace scanloc::client {
namespace {

constexpr std::size_t kMaxRequestIdBytes = 128;

}  // namespace

absl::Status CheckRequestId(const std::string& id) {
  const bool is_good =
      id.size() <= kMaxRequestIdBytes &&
      std::ranges::all_of(id, [](unsigned char c) { return std::isgraph(c) != 0; });
  if (is_good) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("request_id is not at most ", kMaxRequestIdBytes,
                                                 " printable characters without spaces"));
}

void SendRequestId(const std::string& id, grpc::ClientContext& context) {
  if (!id.empty()) context.AddMetadata("x-request-id", id);
}

void SendMapName(const std::string& map, grpc::ClientContext& context) {
  // What is no name of a map is for the server to refuse.
  const bool is_text =
      map.size() <= limits::kMaxNameBytes &&
      std::ranges::all_of(map, [](unsigned char c) { return std::isgraph(c) != 0; });
  if (!map.empty() && is_text) context.AddMetadata("scanloc-map", map);
}

}  // namespace scanloc::client
