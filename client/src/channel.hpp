#pragma once

#include <grpc/support/time.h>
#include <grpcpp/channel.h>

#include <chrono>
#include <memory>

#include "absl/status/statusor.h"
#include "scanloc/client/client.hpp"

namespace scanloc::client {

/// Not the time of day: that may be set while a call runs.
using Clock = std::chrono::steady_clock;

/// The same moment, as gRPC counts it.
[[nodiscard]] gpr_timespec ToGpr(Clock::time_point time);

/// A channel that is not connected yet. InvalidArgument if a file for TLS cannot be read.
[[nodiscard]] absl::StatusOr<std::shared_ptr<grpc::Channel>> MakeChannel(
    const ClientOptions& options);

/// Ends at the first failure: a robot should learn at once that nobody listens there.
[[nodiscard]] bool AwaitReady(grpc::Channel& channel, Clock::time_point deadline);

}  // namespace scanloc::client
