#pragma once

#include <functional>
#include <future>
#include <memory>

#include "scanloc/client/localization_client.hpp"

namespace scanloc::client {

/// Asks without waiting: queries wait in a queue for a few threads that call the client.
/// Thread-safe.
class AsyncClient {
 public:
  using Callback = std::function<void(absl::StatusOr<LocalizeReply> reply)>;

  /// num_threads: calls at once, at least 1.
  explicit AsyncClient(std::shared_ptr<const LocalizationClient> client, int num_threads = 4);

  /// Queries that still wait end with Cancelled; those under way end first, within their timeouts.
  /// Not from a callback.
  ~AsyncClient();
  AsyncClient(const AsyncClient&) = delete;
  AsyncClient& operator=(const AsyncClient&) = delete;

  [[nodiscard]] std::future<absl::StatusOr<LocalizeReply>> LocalizeScan(
      PointCloud scan, RequestOptions options = {});
  [[nodiscard]] std::future<absl::StatusOr<LocalizeReply>> LocalizeDescriptor(
      SignedDescriptor descriptor, RequestOptions options = {});

  /// The callback is called once, from a thread of the client, and must not throw. The timeout
  /// counts from when the call begins, not from here.
  void LocalizeScan(PointCloud scan, RequestOptions options, Callback callback);
  void LocalizeDescriptor(SignedDescriptor descriptor, RequestOptions options, Callback callback);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace scanloc::client
