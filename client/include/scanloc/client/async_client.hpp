#pragma once

#include <functional>
#include <future>
#include <memory>

#include "scanloc/client/localization_client.hpp"

namespace scanloc::client {

/// Asks without waiting: queries wait in a bounded queue for a few threads that call the client.
/// Thread-safe.
class AsyncClient {
 public:
  using Callback = std::function<void(absl::StatusOr<LocalizeReply> reply)>;

  /// num_threads: calls at once; max_waiting: queries that wait for one of them; each at least 1.
  /// One more ends at once with ResourceExhausted: a robot that far behind is better off with a
  /// fresh scan, and scans of megabytes do not pile up while a server is away.
  explicit AsyncClient(std::shared_ptr<const LocalizationClient> client, int num_threads = 4,
                       int max_waiting = 64);

  /// Queries that still wait end with Cancelled; those under way end first, within their timeouts.
  /// Not from a callback.
  ~AsyncClient();
  AsyncClient(const AsyncClient&) = delete;
  AsyncClient& operator=(const AsyncClient&) = delete;

  [[nodiscard]] std::future<absl::StatusOr<LocalizeReply>> LocalizeScan(
      PointCloud scan, RequestOptions options = {});
  [[nodiscard]] std::future<absl::StatusOr<LocalizeReply>> LocalizeDescriptor(
      SignedDescriptor descriptor, RequestOptions options = {});

  /// The callback is called once, from a thread of the client (or from here if the query finds no
  /// room to wait), and must not throw. The timeout counts from when the call begins, not from
  /// here.
  void LocalizeScan(PointCloud scan, RequestOptions options, Callback callback);
  void LocalizeDescriptor(SignedDescriptor descriptor, RequestOptions options, Callback callback);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace scanloc::client
