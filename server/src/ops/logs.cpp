#include "ops/logs.hpp"

#include <spdlog/formatter.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
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

}  // namespace scanloc::server
