// What an operator writes: the first byte chooses token file, map source or file of options, the
// rest is its text.
#include <sys/mman.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "admission/access.hpp"
#include "scanloc/server/server_options.hpp"

namespace {

using namespace scanloc::server;

void ReadTokens(const std::string& text) {
  const int fd = memfd_create("tokens", 0);
  if (fd >= 0 && write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size())) {
    (void)Access::Create("/proc/self/fd/" + std::to_string(fd));
  }
  close(fd);
}

/// Options of every kind that scanlocd has, read as it reads them.
void ReadOptions(const std::string& text) {
  ServerOptions options;
  std::vector<std::string> maps;
  CLI::App app("options", "options");
  app.add_option("--map", maps)->take_all()->expected(1);
  app.add_option("--listen", options.listen);
  app.add_option("--max-inflight", options.max_inflight);
  app.add_option("--max-rate", options.max_rate_per_s);
  app.add_option("--max-capture-bytes", options.max_capture_bytes);
  app.add_option("--log-requests", options.log_requests)
      ->transform(CLI::CheckedTransformer(std::map<std::string, RequestLog>{
          {"none", RequestLog::kNone}, {"failed", RequestLog::kFailed}}));
  app.add_flag("--admin", options.admin);
  app.allow_config_extras(CLI::config_extras_mode::error);
  std::istringstream file(text);
  try {
    app.parse_from_stream(file);
  } catch (const std::exception&) {
    return;  // as the program does, which tells it and ends
  }
  for (const std::string& map : maps) {
    if (const auto source = ParseMapSource(map); source.ok()) options.maps.push_back(*source);
  }
  (void)Validate(options);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 3) {
    case 0:
      ReadTokens(text);
      break;
    case 1: {
      const auto source = ParseMapSource(text);
      if (source.ok()) (void)CheckMapName(source->name);
      break;
    }
    default:
      ReadOptions(text);
  }
  return 0;
}
