#include "socket_drops.hpp"

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <system_error>

namespace scanloc::ros2 {
namespace {

/// The inodes of this process's sockets.
std::set<std::string> OwnSockets() {
  const std::string kBefore = "socket:[";
  std::set<std::string> inodes;
  std::error_code error;
  for (std::filesystem::directory_iterator fd("/proc/self/fd", error), end; !error && fd != end;
       fd.increment(error)) {
    std::error_code closed;
    const std::string target = std::filesystem::read_symlink(fd->path(), closed).string();
    if (target.starts_with(kBefore)) {
      inodes.insert(target.substr(kBefore.size(), target.size() - kBefore.size() - 1));
    }
  }
  return inodes;
}

}  // namespace

std::uint64_t NumDroppedDatagrams() {
  constexpr int kInodeColumn = 9;
  const std::set<std::string> own = OwnSockets();
  std::uint64_t num_dropped = 0;
  for (const char* const table : {"/proc/self/net/udp", "/proc/self/net/udp6"}) {
    std::ifstream file(table);
    std::string line;
    std::getline(file, line);  // names
    while (std::getline(file, line)) {
      std::istringstream columns(line);
      std::string column;
      std::string inode;
      for (int i = 0; columns >> column; ++i) {
        if (i == kInodeColumn) inode = column;
      }
      // The last column.
      if (own.contains(inode)) num_dropped += std::strtoull(column.c_str(), nullptr, 10);
    }
  }
  return num_dropped;
}

std::uint64_t LargestReceiveBuffer_bytes() {
  std::uint64_t bytes = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> bytes;
  return bytes;
}

}  // namespace scanloc::ros2
