#pragma once

#include <spdlog/common.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace scanloc::server {

enum class LogFormat : std::uint8_t { kText, kJson };

/// Sends the log of this process to stderr: lines for people, or one JSON object a line with time,
/// level, message and what fields a line has. Call once, before other threads log.
void StartLogging(spdlog::level::level_enum level, LogFormat format);

using LogFields = std::vector<std::pair<std::string, std::string>>;

/// One line with fields: `message name=value ...`, or members of the JSON object. Values may hold
/// any bytes.
void LogWith(spdlog::level::level_enum level, const std::string& message, const LogFields& fields);

}  // namespace scanloc::server
