#include "scanloc/server/server_options.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <set>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::server {
namespace {

constexpr int kMaxServerThreads = 1024;
constexpr int kMaxInflight = 100'000;
constexpr int kMaxStreams = 1'000'000;
constexpr int kMinMessageBytes = 1 << 10;
constexpr double kMaxDrain_s = 3600.0;
constexpr double kMinMemoryBytes = 64 << 20;
constexpr double kMaxMemoryBytes = 1e15;
constexpr double kMinReceive_s = 0.01;
constexpr double kMaxStreamIdle_s = 86'400.0;
/// Of one point on the wire: x y z.
constexpr std::int64_t kWirePointBytes = 12;
/// Descriptors of the largest shape fit, whatever the scans that are allowed.
constexpr std::int64_t kOtherMessageBytes = 3 << 20;
constexpr double kMaxRate_per_s = 1e6;
constexpr int kMaxRecentAnswers = 100'000;
constexpr double kMaxMapHealth_s = 86400.0;
constexpr double kMinCaptureBytes = 1 << 20;
constexpr double kMaxCaptureBytes = 1e15;

absl::Status CheckRange(const char* field, double value, double low, double high) {
  if (value >= low && value <= high) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", value, "; it must lie in [", low, ", ", high, "]"));
}

absl::Status CheckMaps(const ServerOptions& options) {
  const std::vector<MapSource>& maps = options.maps;
  if (maps.empty() && options.maps_dir.empty() && !options.catalogue.enabled()) {
    return absl::InvalidArgumentError(
        "no map to serve; give at least one as NAME=FILE, or a folder of maps");
  }
  const CatalogueOptions& catalogue = options.catalogue;
  const bool has_all =
      catalogue.enabled() && !catalogue.store.empty() && !catalogue.cache_dir.empty();
  const bool has_any =
      catalogue.enabled() || !catalogue.store.empty() || !catalogue.cache_dir.empty();
  if (has_any && !has_all) {
    return absl::InvalidArgumentError(
        "a catalogue needs a store and a cache folder, and they it: give all of --catalogue, "
        "--store "
        "and --cache-dir");
  }
  std::set<std::string> names;
  for (const MapSource& map : maps) {
    RETURN_IF_ERROR(CheckMapName(map.name));
    if (map.path.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("map ", map.name, " has no file"));
    }
    if (!names.insert(map.name).second) {
      return absl::InvalidArgumentError(
          absl::StrCat("two maps are named ", map.name, "; every map needs a name of its own"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckAddress(const char* field, const std::string& listen) {
  const std::size_t colon = listen.rfind(':');
  int port = -1;
  if (colon == std::string::npos || colon == 0 ||
      !absl::SimpleAtoi(listen.substr(colon + 1), &port) || port < 0 || port > 65535) {
    return absl::InvalidArgumentError(absl::StrCat(
        field, " is \"", listen, "\"; it must be HOST:PORT with a port in [0, 65535]"));
  }
  return absl::OkStatus();
}

bool IsLocal(const std::string& listen) {
  const std::string host = listen.substr(0, listen.rfind(':'));
  if (host == "localhost" || host == "[::1]" || absl::StartsWith(host, "unix:")) return true;
  // A name that only begins like an address may be anywhere.
  in_addr address = {};
  return inet_pton(AF_INET, host.c_str(), &address) == 1 && ntohl(address.s_addr) >> 24 == 127;
}

absl::Status CheckTls(const ServerOptions& options) {
  const TlsOptions& tls = options.tls;
  if (tls.cert_file.empty() != tls.key_file.empty()) {
    return absl::InvalidArgumentError(
        "TLS needs both a certificate and its private key; give both or neither");
  }
  if (!tls.enabled() && !tls.client_ca_file.empty()) {
    return absl::InvalidArgumentError(
        "a CA for clients' certificates is of no use without a certificate of the server");
  }
  if (tls.enabled() || IsLocal(options.listen) || options.allow_plaintext) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "listening on ", options.listen,
      " without TLS would let the network read and change what robots are told; give a "
      "certificate, listen on 127.0.0.1, or allow plaintext in so many words"));
}

absl::Status CheckMetrics(const ServerOptions& options) {
  if (options.metrics_listen.empty()) return absl::OkStatus();
  absl::Status status = CheckAddress("metrics_listen", options.metrics_listen);
  if (!status.ok() || options.allow_plaintext_metrics || options.allow_plaintext ||
      IsLocal(options.metrics_listen)) {
    return status;
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "metrics on ", options.metrics_listen,
      " would be open to the network, without encryption or tokens; serve them on 127.0.0.1, or "
      "allow plaintext metrics in so many words"));
}

}  // namespace

absl::Status CheckMapName(const std::string& name) {
  const bool good = std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-';
  });
  if (good && !name.empty() && name.size() <= limits::kMaxNameBytes) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("map name \"", name, "\" is not one to ",
                                                 limits::kMaxNameBytes,
                                                 " letters, digits, '.', '_' or '-'"));
}

absl::StatusOr<MapSource> ParseMapSource(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", text, "\" is not NAME=FILE, for example town=/srv/maps/town.scanloc"));
  }
  return MapSource{.name = text.substr(0, equals), .path = text.substr(equals + 1)};
}

int LargestMessageBytes(const ServerOptions& options) {
  return static_cast<int>(std::min<std::int64_t>(
      options.max_message_bytes, kWirePointBytes * options.max_points + kOtherMessageBytes));
}

absl::Status Validate(const ServerOptions& options) {
  absl::Status status = CheckMaps(options);
  status.Update(CheckAddress("listen", options.listen));
  status.Update(CheckTls(options));
  if (options.admin && options.token_file.empty()) {
    status.Update(absl::InvalidArgumentError("admin needs a token file that says who may"));
  }
  status.Update(CheckRange("num_threads", options.num_threads, 0, kMaxServerThreads));
  status.Update(CheckRange("max_inflight", options.max_inflight, 1, kMaxInflight));
  status.Update(CheckRange("max_wait_s", options.max_wait_s, 0.001, kMaxDrain_s));
  status.Update(CheckRange("max_streams", options.max_streams, 0, kMaxStreams));
  status.Update(
      CheckRange("max_streams_per_client", options.max_streams_per_client, 0, kMaxStreams));
  status.Update(CheckRange("max_rate_per_s", options.max_rate_per_s, 0.0, kMaxRate_per_s));
  status.Update(CheckRange("max_points", options.max_points, 1,
                           static_cast<double>(limits::kMaxPointsPerScan)));
  status.Update(CheckRange("max_candidates", options.max_candidates, 1, limits::kMaxCandidates));
  status.Update(CheckRange("max_capture_bytes", static_cast<double>(options.max_capture_bytes),
                           kMinCaptureBytes, kMaxCaptureBytes));
  status.Update(CheckRange("recent_answers", options.recent_answers, 0, kMaxRecentAnswers));
  status.Update(CheckRange("map_health_s", options.map_health_s, 0.0, kMaxMapHealth_s));
  status.Update(CheckMetrics(options));
  status.Update(CheckRange("max_message_bytes", options.max_message_bytes, kMinMessageBytes,
                           limits::kMaxMessageBytes));
  status.Update(CheckRange("max_memory_bytes", static_cast<double>(options.max_memory_bytes),
                           kMinMemoryBytes, kMaxMemoryBytes));
  for (const auto& [name, bytes] :
       {std::pair{"cache_bytes", options.cache_bytes},
        std::pair{"whole_bytes", options.whole_bytes},
        std::pair{"catalogue.cache_bytes", options.catalogue.cache_bytes}}) {
    status.Update(CheckRange(name, static_cast<double>(bytes), 0.0, kMaxMemoryBytes));
  }
  status.Update(CheckRange("receive_s", options.receive_s, kMinReceive_s, kMaxDrain_s));
  status.Update(
      CheckRange("stream_idle_s", options.stream_idle_s, kMinReceive_s, kMaxStreamIdle_s));
  status.Update(CheckRange("drain_s", options.drain_s, 0.0, kMaxDrain_s));
  return status;
}

}  // namespace scanloc::server
