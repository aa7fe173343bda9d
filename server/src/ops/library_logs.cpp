#include "ops/library_logs.hpp"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <spdlog/spdlog.h>

#include <cstdint>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/string_view.h"
#include "ops/clock.hpp"
#include "ops/logs.hpp"

namespace scanloc::server {
namespace {

constexpr int kMaxHandshakesPerPeriod = 10;
constexpr std::int64_t kPeriod_ns = 60'000'000'000;

/// OpenSSL's words for what clients do, and what that means.
struct Meaning {
  const char* reason;
  const char* meaning;
};
constexpr Meaning kMeanings[] = {
    {"http request", "the client speaks HTTP without TLS"},
    {"wrong version number", "the client speaks without TLS, or is no client of this service"},
    {"peer did not return a certificate",
     "the client shows no certificate; it needs one of "
     "--tls-client-ca"},
    {"certificate verify failed",
     "the client's certificate is not of --tls-client-ca, or is not "
     "valid today"},
    {"unknown ca", "the client does not trust this server's certificate: it has another CA"},
    {"bad certificate", "the client does not take this server's certificate"},
    {"certificate expired",
     "to the client this server's certificate has expired, or its clock is "
     "wrong"},
    {"no shared cipher", "client and server have no cipher in common"},
    {"unsupported protocol", "the client's version of TLS is too old"},
};

/// Says so if the line of gRPC's log tells of a handshake that failed.
bool TellHandshake(const std::string& line) {
  constexpr absl::string_view kBegin = "Handshake failed with fatal error ";
  const std::size_t begin = line.find(kBegin.data());
  if (begin == std::string::npos) return false;
  static LogLimit limit(kMaxHandshakesPerPeriod, kPeriod_ns);
  const auto num_left_out = limit.MayLog(NowNs());
  if (!num_left_out) return true;
  const std::string reason = line.substr(begin + kBegin.size());
  const std::string lower = absl::AsciiStrToLower(reason);
  LogFields fields{{"reason", reason}};
  for (const auto& [words, meaning] : kMeanings) {
    if (absl::StrContains(lower, words)) {
      fields.emplace_back("meaning", std::string(meaning));
      break;
    }
  }
  if (*num_left_out > 0) fields.emplace_back("not_logged_before", *num_left_out);
  LogWith(spdlog::level::warn, "TLS handshake failed", fields);
  return true;
}

}  // namespace

void RouteLibraryLogs() {
  gpr_set_log_function([](gpr_log_func_args* entry) {
    if (TellHandshake(entry->message)) return;
    spdlog::debug("grpc {}:{}: {}", entry->file, entry->line, entry->message);
  });
  google::protobuf::SetLogHandler(
      [](google::protobuf::LogLevel /*level*/, const char* file, int line,
         const std::string& message) { spdlog::debug("protobuf {}:{}: {}", file, line, message); });
}

}  // namespace scanloc::server
