// What scanloc-web reads of a request itself: the first byte chooses target, Host header or
// address, the rest is its text.
#include <cstddef>
#include <cstdint>
#include <string>

#include "http_parts.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace scanloc::web;
  if (size == 0) return 0;
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 3) {
    case 0: {
      Request request;
      if (!ParseTarget(text, &request).ok()) (void)ErrorResponse(400, "INVALID_ARGUMENT", text);
      (void)request.Parameter("map");
      break;
    }
    case 1:
      (void)IsLoopback(HostOf(text));
      break;
    default:
      (void)ParseAddress(text);
  }
  return 0;
}
