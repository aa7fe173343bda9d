#pragma once

#include <chrono>

#include "absl/status/status.h"
#include "scanloc/client/client.hpp"
#include "scanloc/core/scan/point_cloud.hpp"

namespace scanloc::client {

/// InvalidArgument, naming the field, if the time is less than low or more than an hour.
[[nodiscard]] absl::Status CheckTimeout(const char* field, std::chrono::milliseconds timeout,
                                        std::chrono::milliseconds low);

/// InvalidArgument if no message may hold so many points.
[[nodiscard]] absl::Status CheckScanSize(PointView scan);

}  // namespace scanloc::client
