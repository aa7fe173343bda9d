#include "ops/service_manager.hpp"

#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace scanloc::server {

void TellServiceManager(const std::string& state) {
  const char* asked = std::getenv("NOTIFY_SOCKET");
  if (asked == nullptr) return;
  const std::string path = asked;
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) {
    return spdlog::error("NOTIFY_SOCKET is no path of a socket");
  }
  std::memcpy(address.sun_path, path.data(), path.size());
  if (path.front() == '@') address.sun_path[0] = '\0';  // an abstract one
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
  const int file = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool is_sent = file >= 0 && sendto(file, state.data(), state.size(), MSG_NOSIGNAL,
                                           reinterpret_cast<const sockaddr*>(&address), size) >= 0;
  if (!is_sent) spdlog::error("cannot tell the service manager: {}", std::strerror(errno));
  if (file >= 0) close(file);
}

bool IsServiceManagerWatching() {
  const char* time = std::getenv("WATCHDOG_USEC");
  const char* process = std::getenv("WATCHDOG_PID");
  return time != nullptr && (process == nullptr || std::to_string(getpid()) == process);
}

}  // namespace scanloc::server
