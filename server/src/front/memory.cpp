#include "front/memory.hpp"

#include <fcntl.h>
#include <malloc.h>
#include <unistd.h>

#include <array>
#include <cstdio>

namespace scanloc::server {
namespace {

#ifdef __GLIBC__
/// malloc_trim does not give back the free end of a thread's arena. Only a free does, beyond so
/// much: by default 64 MiB, once there were large blocks. A usual scan is less, so that it finds
/// the memory of the one before.
constexpr int kMaxFreeEndBytes = 2 << 20;
/// What is larger goes back to the system as soon as it is freed.
constexpr int kMaxKeptBlockBytes = 4 << 20;
#endif

}  // namespace

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

void KeepLittleFreedMemory() {
#ifdef __GLIBC__
  mallopt(M_MXFAST, 0);  // a small block would be put by, and hide that the end is free
  mallopt(M_TRIM_THRESHOLD, kMaxFreeEndBytes);
  mallopt(M_MMAP_THRESHOLD, kMaxKeptBlockBytes);
#endif
}

void ReturnFreedMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace scanloc::server
