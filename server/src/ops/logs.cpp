#include "ops/logs.hpp"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <spdlog/formatter.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "ops/clock.hpp"
#include "scanloc/core/printable.hpp"

namespace scanloc::server {
namespace {

using Json = nlohmann::ordered_json;

/// Begins the payload of a line that is JSON already: no text that is logged otherwise begins so.
constexpr char kFieldsMark = '\x1e';

std::atomic<LogFormat> log_format = LogFormat::kText;

double Rounded(double value) { return std::round(1e3 * value) / 1e3; }
std::int64_t Rounded(std::int64_t value) { return value; }
const std::string& Rounded(const std::string& text) { return text; }

std::string TextOf(double value) { return absl::StrFormat("%.3f", value); }
std::string TextOf(std::int64_t value) { return absl::StrCat(value); }
std::string TextOf(const std::string& text) {
  const bool is_word = !text.empty() && text.find_first_of(" \"=") == std::string::npos;
  const char* quote = is_word ? "" : "\"";
  return absl::StrCat(quote, absl::Utf8SafeCEscape(text), quote);
}

std::string ToLine(const Json& json) {
  return json.dump(-1, ' ', /*ensure_ascii=*/true, Json::error_handler_t::replace);
}

/// A line for people.
class TextFormatter : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& entry, spdlog::memory_buf_t& line) override {
    const std::string payload = Printable({entry.payload.data(), entry.payload.size()});
    spdlog::details::log_msg printable = entry;
    printable.payload = payload;
    formatter_.format(printable, line);
  }

  [[nodiscard]] std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<TextFormatter>();
  }

 private:
  spdlog::pattern_formatter formatter_;
};

/// `{"time":...,"level":...` of any line.
class JsonFormatter : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& entry, spdlog::memory_buf_t& line) override {
    time_.format(entry, line);  // as far as the level
    const std::string payload(entry.payload.data(), entry.payload.size());
    std::string rest;
    if (!payload.empty() && payload.front() == kFieldsMark) {
      rest = payload.substr(2);  // the mark and the brace
    } else {
      rest = ToLine(Json{{"message", payload}}).substr(1);
    }
    rest += '\n';
    line.append(rest.data(), rest.data() + rest.size());
  }

  [[nodiscard]] std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonFormatter>();
  }

 private:
  spdlog::pattern_formatter time_{R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l",)",
                                  spdlog::pattern_time_type::utc, ""};
};

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

void StartLogging(spdlog::level::level_enum level, LogFormat format) {
  log_format = format;
  auto logger = std::make_shared<spdlog::logger>("scanlocd",
                                                 std::make_shared<spdlog::sinks::stderr_sink_mt>());
  if (format == LogFormat::kJson) {
    logger->set_formatter(std::make_unique<JsonFormatter>());
  } else {
    logger->set_formatter(std::make_unique<TextFormatter>());
  }
  spdlog::set_default_logger(std::move(logger));
  spdlog::set_level(level);
}

void LogWith(spdlog::level::level_enum level, const std::string& message, const LogFields& fields) {
  if (!spdlog::should_log(level)) return;
  if (log_format == LogFormat::kJson) {
    Json json{{"message", message}};
    for (const auto& [name, value] : fields) {
      std::visit([&, &name = name](const auto& told) { json[name] = Rounded(told); }, value);
    }
    spdlog::log(level, "{}{}", kFieldsMark, ToLine(json));
    return;
  }
  std::string line = message;
  for (const auto& [name, value] : fields) {
    absl::StrAppend(&line, " ", name, "=",
                    std::visit([](const auto& told) { return TextOf(told); }, value));
  }
  spdlog::log(level, "{}", line);
}

std::optional<std::int64_t> LogLimit::MayLog(std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  const std::int64_t period = now_ns / period_ns_;
  if (period != period_) num_logged_ = 0;
  period_ = period;
  if (num_logged_ >= max_lines_) {
    ++num_left_out_;
    return std::nullopt;
  }
  ++num_logged_;
  return std::exchange(num_left_out_, 0);
}

void LogLimit::LeaveOut() {
  const std::lock_guard lock(mutex_);
  ++num_left_out_;
}

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
