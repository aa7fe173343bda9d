#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "scanloc/core/answer.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/query.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/track/tracker.hpp"
#include "scanloc/proto/messages.hpp"

namespace scanloc::cli {

/// Who answers queries: a map file in this process, or a server. The same map gives the same
/// answers either way, bit for bit.
class Answerer {
 public:
  Answerer() = default;
  Answerer(const Answerer&) = delete;
  Answerer& operator=(const Answerer&) = delete;
  virtual ~Answerer() = default;

  /// Of the map that is asked.
  [[nodiscard]] virtual const Params& params() const = 0;

  /// Times in the answer are measured, as far as the answerer measures them.
  /// Verification ends after the budget; 0: when it is done.
  [[nodiscard]] virtual absl::StatusOr<Answer> Ask(PointView scan, const Query& query,
                                                   std::chrono::milliseconds budget) = 0;

  /// A scan that was described elsewhere. FailedPrecondition if with other parameters.
  [[nodiscard]] virtual absl::StatusOr<Answer> AskDescribed(const SignedDescriptor& descriptor,
                                                            const Query& query,
                                                            std::chrono::milliseconds budget) = 0;

  /// The next scan of one robot that keeps moving; T_last_scan as in core's Tracker. The options
  /// are those of the first call.
  [[nodiscard]] virtual absl::StatusOr<TrackedAnswer> AskNext(
      PointView scan, const std::optional<Pose>& T_last_scan, const TrackerOptions& options,
      std::chrono::milliseconds budget) = 0;
};

/// Loads the map file. Errors as of mapdb::LoadMap.
[[nodiscard]] absl::StatusOr<std::unique_ptr<Answerer>> AnswerFromFile(const std::string& path);

struct ServerQuery {
  std::string address;           ///< HOST:PORT
  std::string map;               ///< empty: the server's only map
  bool send_descriptor = false;  ///< describe scans here and send only the descriptors
  std::string tls_ca_file;       ///< this and the next two as in client::ClientOptions
  std::string tls_cert_file;
  std::string tls_key_file;
  std::string token_file;                    ///< its first word is the token; empty: none
  std::chrono::milliseconds deadline{5000};  ///< of connecting and of each query
};

/// Connects and asks for the map's parameters. Errors as of client::Client.
[[nodiscard]] absl::StatusOr<std::unique_ptr<Answerer>> AnswerFromServer(const ServerQuery& query);

}  // namespace scanloc::cli
