#pragma once

#include <spdlog/common.h>

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace scanloc::server {

enum class LogFormat : std::uint8_t { kText, kJson };

/// Sends the log of this process to stderr: lines for people, or one JSON object a line with time,
/// level, message and what fields a line has. Whatever a text holds, wherever it comes from, it is
/// one line of printable characters (scanloc::Printable; in JSON, ASCII). Call once, before other
/// threads log.
void StartLogging(spdlog::level::level_enum level, LogFormat format);

/// Sends what gRPC and protobuf would print on stderr to our log at level debug: most of it is what
/// clients do wrong, and any client could fill the log with it. Why a TLS handshake failed is a
/// warning, ten a minute: it is how a wrong certificate is told from a wrong address. Call before
/// any other thread exists.
void RouteLibraryLogs();

/// A number is one in JSON, too; one with a fraction is told with three decimals.
using LogValue = std::variant<std::string, std::int64_t, double>;
using LogFields = std::vector<std::pair<std::string, LogValue>>;

/// One line with fields: `message name=value ...`, or members of the JSON object. Values may hold
/// any bytes.
void LogWith(spdlog::level::level_enum level, const std::string& message, const LogFields& fields);

/// Bounds how many lines of one kind stand in the log. Thread-safe.
class LogLimit {
 public:
  /// So many lines in each period.
  LogLimit(int max_lines, std::int64_t period_ns) : max_lines_(max_lines), period_ns_(period_ns) {}

  /// How many lines were left out since the last one, if one may be written now (monotonic time);
  /// none: this one is left out, too.
  [[nodiscard]] std::optional<std::int64_t> MayLog(std::int64_t now_ns);

  /// Counts a line that is left out whatever there is room for.
  void LeaveOut();

 private:
  const int max_lines_;
  const std::int64_t period_ns_;
  std::mutex mutex_;
  std::int64_t period_ = -1;
  int num_logged_ = 0;             // in that period
  std::int64_t num_left_out_ = 0;  // since the last line
};

}  // namespace scanloc::server
