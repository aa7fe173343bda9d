#pragma once

#include <poll.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

#include "support/process.hpp"

namespace scanloc::test {

/// Waits until somebody opens a file: how far a program has come that says nothing yet.
class OpenWatch {
 public:
  explicit OpenWatch(const std::string& path) : fd_(inotify_init1(IN_CLOEXEC)) {
    if (inotify_add_watch(fd_, path.c_str(), IN_OPEN) < 0) {
      throw std::runtime_error("cannot watch " + path);
    }
  }
  OpenWatch(const OpenWatch&) = delete;
  OpenWatch& operator=(const OpenWatch&) = delete;
  ~OpenWatch() { close(fd_); }

  void Await() const {
    pollfd events = {.fd = fd_, .events = POLLIN, .revents = 0};
    const std::chrono::milliseconds longest = Process::kPatience;
    if (poll(&events, 1, static_cast<int>(longest.count())) != 1) {
      throw std::runtime_error("nobody opens the file");
    }
  }

 private:
  const int fd_;
};

}  // namespace scanloc::test
