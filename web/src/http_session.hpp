#pragma once

// clang-format off
#include <exception>
#include <utility>  // Boost 1.74's awaitable.hpp uses std::exchange without it
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/version.hpp>
// clang-format on
#include <algorithm>
#include <optional>
#include <string>

#include "http_parts.hpp"

/// One connection after the other's requests.
namespace scanloc::web {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using Tcp = asio::ip::tcp;

/// What comes from one address. Touched by the one thread that does all input and output.
struct Guest {
  explicit Guest(const HttpOptions& options)
      : bytes_at_hand(std::max(options.max_bytes_at_hand / 2,
                               static_cast<std::int64_t>(options.max_body_bytes))),
        event_streams((options.max_event_streams + 1) / 2) {}

  int num_connections = 0;
  Counted bytes_at_hand;
  Counted event_streams;
};

/// What every session uses; outlives them all. Touched by the one thread that does all input and
/// output, but for the handler.
struct Service {
  Service(const HttpOptions& http_options, std::function<bool(const Request&)> body_rule,
          Handler on_request)
      : options(http_options),
        takes_body(std::move(body_rule)),
        handler(std::move(on_request)),
        workers(static_cast<std::size_t>(http_options.num_workers)),
        watchers(static_cast<std::size_t>(http_options.num_watchers)),
        waiting(http_options.max_waiting),
        bytes_at_hand(http_options.max_bytes_at_hand),
        event_streams(http_options.max_event_streams) {}

  const HttpOptions options;
  const std::function<bool(const Request&)> takes_body;
  const Handler handler;
  bool is_local = false;                  // listens on this machine only
  std::atomic<bool> is_stopping = false;  ///< begins nothing more
  asio::thread_pool workers;
  asio::thread_pool watchers;
  Counted waiting;
  Counted bytes_at_hand;
  Counted event_streams;
};

/// A connection, with or without TLS: of two kinds of streams, all of the session would be compiled
/// twice.
class Stream {
 public:
  using executor_type = beast::tcp_stream::executor_type;

  /// No context: no TLS.
  Stream(Tcp::socket socket, asio::ssl::context* tls) {
    if (tls == nullptr) {
      plain_.emplace(std::move(socket));
    } else {
      encrypted_.emplace(std::move(socket), *tls);
    }
  }

  executor_type get_executor() { return tcp().get_executor(); }
  beast::tcp_stream& tcp() { return plain_ ? *plain_ : beast::get_lowest_layer(*encrypted_); }

  /// First of all, and only with TLS.
  template <typename Token>
  auto async_handshake(Token&& token) {
    return encrypted_->async_handshake(asio::ssl::stream_base::server, std::forward<Token>(token));
  }
  template <typename Buffers, typename Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return plain_ ? plain_->async_read_some(buffers, std::forward<Token>(token))
                  : encrypted_->async_read_some(buffers, std::forward<Token>(token));
  }
  template <typename Buffers, typename Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    return plain_ ? plain_->async_write_some(buffers, std::forward<Token>(token))
                  : encrypted_->async_write_some(buffers, std::forward<Token>(token));
  }

 private:
  std::optional<beast::tcp_stream> plain_;
  std::optional<beast::ssl_stream<beast::tcp_stream>> encrypted_;
};

/// Runs the work on a worker, and comes back with what it made.
template <typename Work>
asio::awaitable<std::invoke_result_t<Work>> OnWorker(asio::thread_pool& workers, Work work) {
  co_return co_await asio::co_spawn(
      workers,
      [](Work run) -> asio::awaitable<std::invoke_result_t<Work>> {
        co_return run();
      }(std::move(work)),
      asio::use_awaitable);
}

/// So much of what there is for all, and of what one address may have of it. An address may have
/// all where only this machine's are served: there a proxy asks for everybody.
class GuestShare {
 public:
  [[nodiscard]] bool Take(Counted& of_all, Counted* of_guest, std::int64_t amount) {
    if (of_guest != nullptr && !guest_.Take(*of_guest, amount)) return false;
    if (all_.Take(of_all, amount)) return true;
    guest_.Reset();
    return false;
  }
  void Reset() {
    all_.Reset();
    guest_.Reset();
  }

 private:
  Share all_;
  Share guest_;
};

class Session {
 public:
  Session(Stream& stream, Service& service, Guest& guest)
      : stream_(stream), service_(service), guest_(guest) {}

  /// Serves request after request, until the client ends, is too slow, or is in the wrong.
  asio::awaitable<void> Run();

 private:
  using Parser = http::request_parser<http::string_body>;

  asio::awaitable<bool> ReadHeader(Parser& parser);
  /// What is wrong with the request; else nothing, and the request is filled in.
  std::optional<Response> Examine(const Parser& parser, Request* request, GuestShare* bytes);
  asio::awaitable<bool> ReadBody(Parser& parser, Request* request);
  asio::awaitable<Response> Handle(const Request& request);
  asio::awaitable<bool> Send(Response response, bool is_head, bool keep);
  asio::awaitable<void> SendEvents(const Events& events);
  asio::awaitable<bool> Write(const std::string& bytes);

  void ExpireAfter(std::chrono::milliseconds time) { stream_.tcp().expires_after(time); }

  Stream& stream_;
  Service& service_;
  Guest& guest_;
  beast::flat_buffer buffer_;
  beast::error_code error_;
};

}  // namespace scanloc::web
