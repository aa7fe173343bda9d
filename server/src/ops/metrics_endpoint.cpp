#include "ops/metrics_endpoint.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <exception>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "front/listen_sockets.hpp"

namespace scanloc::server {
namespace {

constexpr std::size_t kMaxHttpRequestBytes = 16'384;
constexpr int kMaxTakenAtOnce = 64;
/// How often it is looked at who takes too long.
constexpr int kLookInterval_ms = 100;

std::string Response(const char* status, const std::string& body) {
  return absl::StrCat("HTTP/1.1 ", status,
                      "\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8"
                      "\r\nContent-Length: ",
                      body.size(), "\r\nConnection: close\r\n\r\n", body);
}

}  // namespace

absl::StatusOr<std::unique_ptr<MetricsEndpoint>> MetricsEndpoint::Listen(const std::string& address,
                                                                         const Metrics& metrics) {
  const auto cannot = [&](absl::string_view why) {
    return absl::UnavailableError(
        absl::StrCat("cannot serve metrics on ", address, ": ", why,
                     "; is the host one of this machine's, and is the port free and allowed?"));
  };
  const absl::StatusOr<ListenSockets> listening = ListenAt(address);
  if (!listening.ok()) return cannot(listening.status().message());
  auto endpoint = std::unique_ptr<MetricsEndpoint>(
      new MetricsEndpoint(metrics, eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)));
  for (const int socket : listening->sockets) endpoint->listening_.emplace_back(socket);
  if (endpoint->stop_.get() < 0) return cannot(std::strerror(errno));
  endpoint->address_ = absl::StrCat(address.substr(0, address.rfind(':')), ":", listening->port);
  endpoint->thread_ = std::thread([raw = endpoint.get()] { raw->Run(); });
  return endpoint;
}

MetricsEndpoint::~MetricsEndpoint() {
  const std::uint64_t one = 1;
  if (thread_.joinable()) {
    while (write(stop_.get(), &one, sizeof one) < 0 && errno == EINTR) {
    }
    thread_.join();
  }
}

void MetricsEndpoint::Run() {
  std::vector<pollfd> watched;
  while (true) {
    // Who cannot be let in would else wake the thread again at once.
    const short wanted_of_new = std::exchange(is_short_of_descriptors_, false) ? 0 : POLLIN;
    watched.assign({{stop_.get(), POLLIN, 0}});
    for (const FileDescriptor& socket : listening_)
      watched.push_back({socket.get(), wanted_of_new, 0});
    for (const Client& client : clients_) {
      const short wanted = client.answer.empty() ? POLLIN : POLLOUT;
      watched.push_back({client.socket.get(), wanted, 0});
    }
    poll(watched.data(), watched.size(),
         clients_.empty() && wanted_of_new != 0 ? -1 : kLookInterval_ms);
    if (watched[0].revents != 0) return;
    const auto now = Clock::now();
    std::size_t i = 1 + listening_.size();
    for (Client& client : clients_) {
      const bool is_ready = watched[i++].revents != 0;
      if (is_ready && client.answer.empty()) Read(client);
      if (is_ready && !client.answer.empty()) Write(client);
      const auto patience = client.answer.empty() ? kMaxRequestTime : kMaxTime;
      if (now - client.came > patience) client.is_over = true;
    }
    clients_.remove_if([](const Client& client) { return client.is_over; });
    for (i = 0; i < listening_.size(); ++i) {
      if (watched[1 + i].revents != 0) TakeClients(watched[1 + i].fd);
    }
  }
}

void MetricsEndpoint::TakeClients(int listening) {
  for (int i = 0; i < kMaxTakenAtOnce; ++i) {
    const int descriptor = accept4(listening, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (descriptor < 0) {
      is_short_of_descriptors_ = errno == EMFILE || errno == ENFILE;
      // Room is made as where places are short.
      if (is_short_of_descriptors_ && !clients_.empty()) clients_.pop_front();
      return;
    }
    clients_.emplace_back(descriptor);
    if (clients_.size() > kMaxClients) clients_.pop_front();
  }
}

void MetricsEndpoint::Read(Client& client) const {
  std::array<char, 4096> piece;
  const ssize_t num_read = recv(client.socket.get(), piece.data(), piece.size(), 0);
  if (num_read < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (num_read <= 0) {
    client.is_over = true;
    return;
  }
  client.request.append(piece.data(), static_cast<std::size_t>(num_read));
  if (absl::StrContains(client.request, "\r\n\r\n")) {
    client.answer = AnswerTo(client.request);
  } else if (client.request.size() > kMaxHttpRequestBytes) {
    client.answer = Response("431 Request Header Fields Too Large", "");
  }
}

void MetricsEndpoint::Write(Client& client) {
  const ssize_t num_sent =
      send(client.socket.get(), client.answer.data(), client.answer.size(), MSG_NOSIGNAL);
  if (num_sent < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (num_sent <= 0 || static_cast<std::size_t>(num_sent) == client.answer.size()) {
    client.is_over = true;
    return;
  }
  client.answer.erase(0, static_cast<std::size_t>(num_sent));
}

std::string MetricsEndpoint::AnswerTo(const std::string& request) const {
  const std::vector<std::string> words =
      absl::StrSplit(request.substr(0, request.find("\r\n")), ' ');
  if (words.size() != 3 || !absl::StartsWith(words[2], "HTTP/1.")) {
    return Response("400 Bad Request", "");
  }
  if (words[0] != "GET") return Response("405 Method Not Allowed", "");
  if (words[1].substr(0, words[1].find('?')) != "/metrics") return Response("404 Not Found", "");
  try {
    return Response("200 OK", metrics_.Text());
  } catch (const std::exception& error) {
    return Response("503 Service Unavailable", absl::StrCat(error.what(), "\n"));
  }
}

}  // namespace scanloc::server
