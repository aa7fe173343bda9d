#pragma once

#include <grpcpp/client_context.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "scanloc/client/client.hpp"
#include "scanloc/v1/localization.grpc.pb.h"

namespace scanloc::client {

/// A LocalizeStream call, one request and its response at a time, each in its time. One thread at a
/// time may call.
class StreamCall final
    : private grpc::ClientBidiReactor<v1::LocalizeStreamRequest, v1::LocalizeStreamResponse> {
 public:
  /// The stub must outlive the call.
  StreamCall(v1::Localization::Stub& stub, const ClientOptions& options,
             const std::string& request_id, const std::string& map);
  ~StreamCall() override;  ///< cancels what is under way and waits for its end

  /// After an error the call has ended.
  [[nodiscard]] absl::Status Ask(const v1::LocalizeStreamRequest& request,
                                 std::chrono::milliseconds timeout,
                                 v1::LocalizeStreamResponse* response);
  /// Ends the call; the status that it ended with. May be called again.
  absl::Status Close(std::chrono::milliseconds timeout);

 private:
  void OnWriteDone(bool ok) override { EndOne(ok); }
  void OnReadDone(bool ok) override { EndOne(ok); }
  void OnDone(const grpc::Status& status) override;

  /// Of a write and a read.
  void EndOne(bool ok);
  /// Gives up the right to start further work, and waits for the end.
  absl::Status AwaitEnd(std::unique_lock<std::mutex>& lock);

  grpc::ClientContext context_;
  v1::LocalizeStreamRequest request_;
  v1::LocalizeStreamResponse response_;
  std::mutex mutex_;
  std::condition_variable has_news_;
  int num_under_way_ = 0;  // a write, a read
  bool has_failed_ = false;
  bool is_held_ = true;
  std::optional<absl::Status> end_;
};

}  // namespace scanloc::client
