#include "memory.hpp"

#include <fcntl.h>
#include <malloc.h>
#include <unistd.h>

#include <array>
#include <cstdio>

namespace scanloc::server {

ProcessMemory MeasureMemory() {
  // Opened once: it must not fail when there are no more descriptors.
  static const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  std::array<char, 128> text{};
  long long num_virtual = 0;
  long long num_resident = 0;
  if (pread(file, text.data(), text.size() - 1, 0) <= 0 ||
      std::sscanf(text.data(), "%lld %lld", &num_virtual, &num_resident) != 2) {
    return {};
  }
  const std::int64_t page = sysconf(_SC_PAGESIZE);
  return {.resident_bytes = num_resident * page, .virtual_bytes = num_virtual * page};
}

void ReturnFreedMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace scanloc::server
