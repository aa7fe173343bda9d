#pragma once

#include <cstdint>

namespace scanloc::server {

/// What the process holds [bytes]; 0 where the system does not tell.
struct ProcessMemory {
  std::int64_t resident_bytes = 0;
  std::int64_t virtual_bytes = 0;
};
[[nodiscard]] ProcessMemory MeasureMemory();

/// Has the allocator keep little of what is freed. Once, before there are threads.
void KeepLittleFreedMemory();

/// Gives memory that was freed back to the system, which the allocator would keep.
void ReturnFreedMemory();

}  // namespace scanloc::server
