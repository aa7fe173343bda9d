#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

/// HTTP/1.1 for strangers: whatever they send, or do not read, costs a bounded amount of memory,
/// time and threads.
namespace scanloc::web {

struct Request {
  std::string method;
  std::string path;  ///< unescaped, with the slash it begins with
  std::vector<std::pair<std::string, std::string>> parameters;  ///< behind the "?", unescaped
  std::string token;          ///< of "Authorization: Bearer", may be empty; as is the rest
  std::string request_id;     ///< X-Request-Id
  std::string last_event_id;  ///< Last-Event-ID
  std::string body;

  /// The first of the name, or nothing.
  [[nodiscard]] std::optional<std::string> Parameter(std::string_view name) const;
};

/// Makes the next piece of an event stream, maybe an empty one; none: it is over. Called every
/// HttpOptions::event_interval, on a watcher.
using Events = std::function<std::optional<std::string>()>;

struct Response {
  int status = 200;
  std::string content_type = "application/json";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers = {};
  Events events = nullptr;  ///< if set, the body is text/event-stream and goes on with these
};

/// Called on a worker; what it throws becomes status 500.
using Handler = std::function<Response(const Request& request)>;

struct HttpOptions {
  std::string listen = "127.0.0.1:8080";  ///< HOST:PORT, or [HOST]:PORT; port 0 takes a free one
  std::string tls_cert_file;              ///< PEM, with its key; both empty: no encryption
  std::string tls_key_file;
  /// Names by which the server may be addressed where it listens on this machine only, beside
  /// localhost and the addresses of this machine: what stands in "Host". Others are refused, so
  /// that no page from elsewhere can pass for one of this server (DNS rebinding).
  std::vector<std::string> hosts;

  int max_connections = 256;   ///< one more is closed at once
  int max_of_address = 128;    ///< of these, from one address
  int max_event_streams = 32;  ///< half of them to one address, but where all are this machine's
  int num_workers = 8;
  int num_watchers = 2;  ///< threads for event streams, which keep no request waiting
  int max_waiting = 64;  ///< requests that run or wait for a worker; one more gets 503
  std::size_t max_header_bytes = 16 << 10;
  std::size_t max_body_bytes = 64 << 20;
  /// Bodies of requests, all together; those of one address half of it, likewise.
  std::int64_t max_bytes_at_hand = std::int64_t{256} << 20;
  std::chrono::milliseconds idle{30'000};     ///< for a handshake, a header, the next request
  std::chrono::milliseconds receive{30'000};  ///< for a whole body
  std::chrono::milliseconds send{60'000};  ///< for a whole response, or a piece of an event stream
  std::chrono::milliseconds event_interval{500};
};

/// OK, or InvalidArgument: no HOST:PORT.
[[nodiscard]] absl::StatusOr<std::pair<std::string, std::uint16_t>> ParseAddress(
    const std::string& listen);
/// Whether only this machine reaches the address.
[[nodiscard]] bool IsLoopback(const std::string& host);

class HttpServer {
 public:
  /// Listens, and serves on threads of its own. takes_body: which requests may have one, by method
  /// and path; others are refused unread. Unavailable: cannot listen there. InvalidArgument: bad
  /// files.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<HttpServer>> Start(
      const HttpOptions& options, std::function<bool(const Request&)> takes_body, Handler handler);

  /// Ends at once what waits for a client, and refuses what has not begun. Waits for the handlers
  /// at work, whose responses are sent if they take little time.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// http://HOST:PORT, or https.
  [[nodiscard]] const std::string& url() const;

 private:
  struct State;
  explicit HttpServer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace scanloc::web
