#include "descriptors.hpp"

#include <sys/resource.h>

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "gateway.hpp"

namespace scanloc::web {
namespace {

/// gRPC's own, and whatever is open for a moment.
constexpr std::int64_t kOwnDescriptors = 48;
constexpr std::int64_t kLeastConnections = 16;

}  // namespace

absl::StatusOr<int> ConnectionsThatFit(const HttpOptions& options) {
  rlimit limit = {};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return options.max_connections;
  rlimit raised = limit;
  raised.rlim_cur = raised.rlim_max;
  if (setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
  // Who watches or asks holds the connection to the server that he began with, though the gateway
  // may have let go of it.
  const std::int64_t reserved = kOwnDescriptors + static_cast<std::int64_t>(Gateway::kMaxClients) +
                                options.max_event_streams + options.num_workers;
  const auto open = static_cast<std::int64_t>(std::min<rlim_t>(limit.rlim_cur, 1U << 30));
  if (open < reserved + kLeastConnections) {
    return absl::FailedPreconditionError(absl::StrCat(
        "only ", open, " files and connections may be open at once, and ",
        reserved + kLeastConnections, " are needed: raise the limit (ulimit -n, LimitNOFILE)"));
  }
  return static_cast<int>(std::min<std::int64_t>(options.max_connections, open - reserved));
}

}  // namespace scanloc::web
