#include "http_server.hpp"

#include <array>
#include <map>
#include <new>
#include <set>
#include <thread>

#include "absl/strings/str_cat.h"
#include "http_session.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::web {
namespace {

constexpr std::chrono::milliseconds kAcceptAgain(100);
constexpr std::chrono::seconds kPatience(3);
constexpr std::chrono::seconds kLinger(1);

/// Of an IPv6 address only the network counts: whoever has one has all of its addresses.
std::string NetworkOf(const asio::ip::address& address) {
  if (address.is_v4()) return address.to_string();
  const asio::ip::address_v6 v6 = address.to_v6();
  // As they come to a socket that listens on [::].
  if (v6.is_v4_mapped()) return asio::ip::make_address_v4(asio::ip::v4_mapped, v6).to_string();
  const auto bytes = v6.to_bytes();
  return std::string(bytes.begin(), bytes.begin() + 8);
}

}  // namespace

struct HttpServer::State {
  State(const HttpOptions& options, std::function<bool(const Request&)> takes_body, Handler handler)
      : service(options, std::move(takes_body), std::move(handler)), acceptor(io) {}

  absl::Status Listen();
  absl::Status UseTls();
  asio::awaitable<void> Accept();
  /// Serves the connection, or closes it.
  void Admit(Tcp::socket socket);
  asio::awaitable<void> Serve(Tcp::socket socket, std::string network);
  asio::awaitable<void> RunSession(Stream& stream, Guest& guest);
  static asio::awaitable<void> Drain(Stream& stream);

  /// Of a connection, for as long as it lasts. Used by the one thread of io only.
  struct Slot {
    Slot(State& state, const std::string& network, Tcp::socket::native_handle_type socket);
    ~Slot();
    State& state;
    const std::map<std::string, Guest>::iterator guest;
    const int socket;
  };

  Service service;
  std::string url;
  std::set<int> sockets;
  std::map<std::string, Guest> guests;  // by network
  asio::ssl::context tls{asio::ssl::context::tls_server};
  asio::io_context io{1};  // sessions that are left end with it
  Tcp::acceptor acceptor;
  std::thread thread;
};

HttpServer::State::Slot::Slot(State& of, const std::string& network,
                              Tcp::socket::native_handle_type native)
    : state(of), guest(of.guests.try_emplace(network, of.service.options).first), socket(native) {
  state.sockets.insert(socket);
  ++guest->second.num_connections;
}

HttpServer::State::Slot::~Slot() {
  state.sockets.erase(socket);
  if (--guest->second.num_connections == 0) state.guests.erase(guest);
}

absl::Status HttpServer::State::UseTls() {
  const HttpOptions& options = service.options;
  if (options.tls_cert_file.empty() != options.tls_key_file.empty()) {
    return absl::InvalidArgumentError(
        "TLS needs both a certificate and its private key; give both or neither");
  }
  if (options.tls_cert_file.empty()) return absl::OkStatus();
  beast::error_code error;
  tls.set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 |
                      asio::ssl::context::no_tlsv1_1,
                  error);
  constexpr std::int64_t kMostBytes = 4 << 20;
  ASSIGN_OR_RETURN(const std::string cert, ReadFile(options.tls_cert_file, kMostBytes));
  ASSIGN_OR_RETURN(const std::string key, ReadFile(options.tls_key_file, kMostBytes));
  if (!error) tls.use_certificate_chain(asio::buffer(cert), error);
  if (error) {
    return absl::InvalidArgumentError(absl::StrCat("certificate '", options.tls_cert_file,
                                                   "' cannot be used: ", error.message()));
  }
  tls.use_private_key(asio::buffer(key), asio::ssl::context::pem, error);
  if (error) {
    return absl::InvalidArgumentError(
        absl::StrCat("private key '", options.tls_key_file, "' cannot be used: ", error.message()));
  }
  return absl::OkStatus();
}

absl::Status HttpServer::State::Listen() {
  ASSIGN_OR_RETURN(const auto address, ParseAddress(service.options.listen));
  RETURN_IF_ERROR(UseTls());
  const auto& [host, port] = address;
  beast::error_code error;
  const auto found =
      Tcp::resolver(io).resolve(host, std::to_string(port), Tcp::resolver::passive, error);
  if (!error && !found.empty()) {
    const Tcp::endpoint endpoint = found.begin()->endpoint();
    service.is_local = endpoint.address().is_loopback();
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  }
  if (error || !acceptor.is_open()) {
    return absl::UnavailableError(
        absl::StrCat("cannot listen on ", service.options.listen, ": ", error.message()));
  }
  const std::string shown = host.find(':') == std::string::npos ? host : "[" + host + "]";
  url = absl::StrCat(service.options.tls_cert_file.empty() ? "http://" : "https://", shown, ":",
                     acceptor.local_endpoint().port());
  return absl::OkStatus();
}

asio::awaitable<void> HttpServer::State::Accept() {
  asio::steady_timer timer(io);
  while (!service.is_stopping) {
    beast::error_code error;
    Tcp::socket socket =
        co_await acceptor.async_accept(asio::redirect_error(asio::use_awaitable, error));
    if (service.is_stopping) break;
    if (error) {  // as a rule there are no descriptors left
      timer.expires_after(kAcceptAgain);
      co_await timer.async_wait(asio::redirect_error(asio::use_awaitable, error));
      continue;
    }
    try {
      Admit(std::move(socket));
    } catch (const std::bad_alloc&) {
      // This one is closed; others may come when there is memory.
    }
  }
}

void HttpServer::State::Admit(Tcp::socket socket) {
  const HttpOptions& options = service.options;
  beast::error_code error;
  const Tcp::endpoint peer = socket.remote_endpoint(error);
  if (error) return;
  std::string network = NetworkOf(peer.address());
  const auto guest = guests.find(network);
  const int num_of_network = guest == guests.end() ? 0 : guest->second.num_connections;
  if (static_cast<int>(sockets.size()) < options.max_connections &&
      num_of_network < options.max_of_address) {
    asio::co_spawn(io, Serve(std::move(socket), std::move(network)), asio::detached);
  }
}

asio::awaitable<void> HttpServer::State::Serve(Tcp::socket socket, std::string network) {
  const Slot slot(*this, network, socket.native_handle());
  beast::error_code error;
  socket.set_option(Tcp::no_delay(true), error);
  const bool is_plain = service.options.tls_cert_file.empty();
  Stream stream(std::move(socket), is_plain ? nullptr : &tls);
  if (!is_plain) {
    stream.tcp().expires_after(service.options.idle);
    co_await stream.async_handshake(asio::redirect_error(asio::use_awaitable, error));
    if (error) co_return;
  }
  co_await RunSession(stream, slot.guest->second);
  if (is_plain) stream.tcp().socket().shutdown(Tcp::socket::shutdown_send, error);
  co_await Drain(stream);
}

/// Reads what the client still sends, for a little while: a connection that is closed with bytes
/// unread is reset, and takes the response with it.
asio::awaitable<void> HttpServer::State::Drain(Stream& stream) {
  stream.tcp().expires_after(kLinger);
  std::array<char, 16 << 10> unread;
  for (beast::error_code error; !error;) {
    co_await stream.async_read_some(asio::buffer(unread),
                                    asio::redirect_error(asio::use_awaitable, error));
  }
}

asio::awaitable<void> HttpServer::State::RunSession(Stream& stream, Guest& guest) {
  try {
    Session session(stream, service, guest);
    co_await session.Run();
  } catch (const std::exception&) {
    // Out of memory: this connection ends, the others go on.
  }
}

absl::StatusOr<std::unique_ptr<HttpServer>> HttpServer::Start(
    const HttpOptions& options, std::function<bool(const Request&)> takes_body, Handler handler) {
  auto state = std::make_unique<State>(options, std::move(takes_body), std::move(handler));
  RETURN_IF_ERROR(state->Listen());
  asio::co_spawn(state->io, state->Accept(), asio::detached);
  state->thread = std::thread([io = &state->io] { io->run(); });
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(state)));
}

HttpServer::HttpServer(std::unique_ptr<State> state) : state_(std::move(state)) {}

HttpServer::~HttpServer() {
  State& state = *state_;
  state.service.is_stopping = true;
  asio::post(state.io, [&state] {
    beast::error_code error;
    state.acceptor.close(error);
    // Reading ends; answers under way are still written.
    for (const int socket : state.sockets) ::shutdown(socket, SHUT_RD);
  });
  const auto end = std::chrono::steady_clock::now() + kPatience;
  asio::steady_timer watch(state.io);
  std::function<void(beast::error_code)> look = [&](beast::error_code) {
    if (state.sockets.empty() || std::chrono::steady_clock::now() > end) return state.io.stop();
    watch.expires_after(std::chrono::milliseconds(10));
    watch.async_wait(look);
  };
  asio::post(state.io, [&look] { look({}); });
  state.thread.join();
  state.service.workers.join();
  state.service.watchers.join();
}

const std::string& HttpServer::url() const { return state_->url; }

}  // namespace scanloc::web
