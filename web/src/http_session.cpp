#include "http_session.hpp"

#include <algorithm>
#include <new>
#include <sstream>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace scanloc::web {
namespace {

constexpr absl::string_view kBearer = "Bearer ";
/// Nothing from elsewhere is run, shown or asked by the page, and nobody else may frame it.
constexpr const char* kPolicy =
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

std::string Text(beast::string_view text) { return {text.data(), text.size()}; }

void Dress(http::response<http::empty_body>& response) {
  response.set(http::field::server, "scanloc-web");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Content-Security-Policy", kPolicy);
  if (response.find(http::field::cache_control) == response.end()) {
    response.set(http::field::cache_control, "no-store");
  }
}

bool IsMyName(const Service& service, const std::string& host) {
  return !service.is_local || IsLoopback(host) ||
         std::ranges::find(service.options.hosts, host) != service.options.hosts.end();
}

}  // namespace

asio::awaitable<void> Session::Run() {
  buffer_.max_size(service_.options.max_header_bytes + (64 << 10));
  while (!service_.is_stopping) {
    Parser parser;
    if (!co_await ReadHeader(parser)) co_return;
    Request request;
    GuestShare bytes;
    std::optional<Response> response = Examine(parser, &request, &bytes);
    // With a body unread there is no telling where the next request begins.
    const bool keep = !response && parser.get().keep_alive();
    if (!response) {
      if (!co_await ReadBody(parser, &request)) co_return;
      response = co_await Handle(request);
    }
    bytes.Reset();
    const bool is_sent = co_await Send(*std::move(response), request.method == "HEAD", keep);
    if (!is_sent || !keep) co_return;
  }
}

asio::awaitable<bool> Session::ReadHeader(Parser& parser) {
  parser.header_limit(static_cast<std::uint32_t>(service_.options.max_header_bytes));
  parser.body_limit(service_.options.max_body_bytes);
  ExpireAfter(service_.options.idle);
  co_await http::async_read_header(stream_, buffer_, parser,
                                   asio::redirect_error(asio::use_awaitable, error_));
  if (!error_) co_return true;
  if (error_ == http::error::header_limit) {
    co_await Send(ErrorResponse(431, "RESOURCE_EXHAUSTED", "the header of the request is too long"),
                  false, false);
  } else if (error_ == http::error::body_limit) {
    co_await Send(ErrorResponse(413, "RESOURCE_EXHAUSTED",
                                absl::StrCat("the body is larger than ",
                                             service_.options.max_body_bytes, " bytes")),
                  false, false);
  } else if (error_.category() == http::make_error_code(http::error::bad_method).category() &&
             error_ != http::error::end_of_stream && error_ != http::error::partial_message) {
    co_await Send(ErrorResponse(400, "INVALID_ARGUMENT",
                                absl::StrCat("this is no HTTP request: ", error_.message())),
                  false, false);
  }
  co_return false;
}

std::optional<Response> Session::Examine(const Parser& parser, Request* request,
                                         GuestShare* bytes) {
  const auto& message = parser.get();
  request->method = Text(message.method_string());
  if (auto status = ParseTarget(Text(message.target()), request); !status.ok()) {
    return ErrorResponse(400, "INVALID_ARGUMENT", std::string(status.message()));
  }
  if (!IsMyName(service_, HostOf(Text(message[http::field::host])))) {
    return ErrorResponse(421, "INVALID_ARGUMENT",
                         "the request is for another host; start with --host NAME to serve it");
  }
  const std::string authorization = Text(message[http::field::authorization]);
  if (absl::StartsWithIgnoreCase(authorization, kBearer)) {
    request->token = authorization.substr(kBearer.size());
  }
  request->request_id = Text(message["X-Request-Id"]);
  request->last_event_id = Text(message["Last-Event-ID"]);

  const auto length = parser.content_length();
  if (parser.chunked()) {
    return ErrorResponse(411, "INVALID_ARGUMENT", "say how long the body is, in Content-Length");
  }
  if (!length || *length == 0) return std::nullopt;
  if (!service_.takes_body(*request)) {
    return ErrorResponse(413, "INVALID_ARGUMENT", "this takes no body");
  }
  if (message.find(http::field::content_encoding) != message.end()) {
    return ErrorResponse(415, "INVALID_ARGUMENT", "send the body as it is, without an encoding");
  }
  if (!bytes->Take(service_.bytes_at_hand, service_.is_local ? nullptr : &guest_.bytes_at_hand,
                   static_cast<std::int64_t>(*length))) {
    Response busy = ErrorResponse(503, "RESOURCE_EXHAUSTED",
                                  "as many bodies are on their way as may be; try again later");
    busy.headers.emplace_back("Retry-After", "1");
    return busy;
  }
  return std::nullopt;
}

asio::awaitable<bool> Session::ReadBody(Parser& parser, Request* request) {
  if (parser.is_done()) co_return true;
  ExpireAfter(service_.options.receive);
  // GCC 12 goes astray where only one side of && or || waits.
  if (beast::iequals(parser.get()[http::field::expect], "100-continue")) {
    const bool is_sent = co_await Write("HTTP/1.1 100 Continue\r\n\r\n");
    if (!is_sent) co_return false;
  }
  co_await http::async_read(stream_, buffer_, parser,
                            asio::redirect_error(asio::use_awaitable, error_));
  if (error_) co_return false;
  request->body = std::move(parser.get().body());
  co_return true;
}

asio::awaitable<Response> Session::Handle(const Request& request) {
  stream_.tcp().expires_never();
  Share turn;
  if (!turn.Take(service_.waiting, 1)) {
    Response busy =
        ErrorResponse(503, "RESOURCE_EXHAUSTED", "as many requests wait as may; try again later");
    busy.headers.emplace_back("Retry-After", "1");
    co_return busy;
  }
  const auto work = [this, &request]() -> Response {
    if (service_.is_stopping) return ErrorResponse(503, "UNAVAILABLE", "the service is stopping");
    try {
      return service_.handler(request);
    } catch (const std::bad_alloc&) {
      return ErrorResponse(503, "RESOURCE_EXHAUSTED", "out of memory; try again later");
    } catch (const std::exception& error) {
      return ErrorResponse(500, "INTERNAL", absl::StrCat("unexpected error: ", error.what()));
    }
  };
  co_return co_await OnWorker(service_.workers, work);
}

asio::awaitable<bool> Session::Send(Response response, bool is_head, bool keep) {
  GuestShare stream;
  if (response.events && !is_head &&
      !stream.Take(service_.event_streams, service_.is_local ? nullptr : &guest_.event_streams,
                   1)) {
    response = ErrorResponse(503, "RESOURCE_EXHAUSTED",
                             "as many watch as may; try again later, or ask /v1/answers");
    response.headers.emplace_back("Retry-After", "10");
  }
  const bool goes_on = response.events && !is_head;
  http::response<http::empty_body> message(static_cast<http::status>(response.status), 11);
  for (const auto& [name, value] : response.headers) message.set(name, value);
  message.set(http::field::content_type, response.content_type);
  Dress(message);
  message.keep_alive(keep && !response.events);
  if (goes_on) {
    message.chunked(true);
  } else {
    message.content_length(response.body.size());
  }
  // As text: what Beast writes with would take longer to compile than all else here.
  std::ostringstream header;
  header << message.base();
  const std::string head = header.str();
  ExpireAfter(service_.options.send);
  bool is_sent = co_await Write(head);
  if (is_sent && goes_on) {
    co_await SendEvents(response.events);
    co_return false;
  }
  if (is_sent && !is_head) is_sent = co_await Write(response.body);
  co_return is_sent;
}

asio::awaitable<void> Session::SendEvents(const Events& events) {
  asio::steady_timer timer(stream_.get_executor());
  while (!service_.is_stopping) {
    const std::optional<std::string> piece =
        co_await OnWorker(service_.watchers, [this, &events]() -> std::optional<std::string> {
          if (service_.is_stopping) return std::nullopt;
          return events();
        });
    if (!piece) break;
    if (!piece->empty()) {
      ExpireAfter(service_.options.send);
      const std::string chunk = absl::StrCat(absl::Hex(piece->size()), "\r\n", *piece, "\r\n");
      const bool is_sent = co_await Write(chunk);
      if (!is_sent) co_return;
    }
    timer.expires_after(service_.options.event_interval);
    co_await timer.async_wait(asio::redirect_error(asio::use_awaitable, error_));
  }
  const std::string last_chunk = "0\r\n\r\n";
  (void)co_await Write(last_chunk);
}

asio::awaitable<bool> Session::Write(const std::string& bytes) {
  co_await asio::async_write(stream_, asio::buffer(bytes),
                             asio::redirect_error(asio::use_awaitable, error_));
  co_return !error_;
}

}  // namespace scanloc::web
