#include "library_logs.hpp"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <spdlog/spdlog.h>

#include <string>

namespace scanloc::server {

void RouteLibraryLogs() {
  gpr_set_log_function([](gpr_log_func_args* entry) {
    spdlog::debug("grpc {}:{}: {}", entry->file, entry->line, entry->message);
  });
  google::protobuf::SetLogHandler(
      [](google::protobuf::LogLevel /*level*/, const char* file, int line,
         const std::string& message) { spdlog::debug("protobuf {}:{}: {}", file, line, message); });
}

}  // namespace scanloc::server
