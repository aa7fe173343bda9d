#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/status_code_enum.h>

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace scanloc::bench {

/// How a server is asked.
struct LoadOptions {
  std::string address;
  double seconds = 5.0;
  double rate_per_s = 0.0;  ///< 0: as fast as it answers
  int num_inflight = 16;    ///< calls at once, without a rate
  int num_connections = 4;
  double deadline_s = 10.0;
  /// Robots that hold a stream meanwhile and send so many scans a second each.
  int num_streams = 0;
  double stream_rate_per_s = 1.0;
  std::string token;  ///< shown with every call; none if empty
};

/// What became of the calls.
struct LoadResult {
  double seconds = 0.0;
  std::size_t max_response_bytes = 0;
  std::map<grpc::StatusCode, std::vector<double>> times_ms;  ///< by status, in ascending order
  /// Of those refused with RESOURCE_EXHAUSTED, so many were not told when to come again.
  std::size_t num_without_retry_after = 0;
  std::size_t num_stream_answers = 0;
  std::size_t num_streams_broken = 0;  ///< ended by the server

  [[nodiscard]] std::size_t Count(grpc::StatusCode code) const;
  [[nodiscard]] double PerSecond(grpc::StatusCode code) const;
};

/// Asks Localize with the requests (v1.LocalizeRequest) in turn and waits for all answers. At a
/// rate the arrivals are drawn in advance and do not wait for answers, and a request's time counts
/// from when it was due: a server that stalls cannot hide it. Streams send the scans of the
/// requests without their options. Throws std::runtime_error if there is no request.
[[nodiscard]] LoadResult RunLoad(const LoadOptions& options,
                                 const std::vector<grpc::ByteBuffer>& requests);

}  // namespace scanloc::bench
