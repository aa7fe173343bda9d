#pragma once

#include <cstddef>

namespace scanloc {

/// The bytes are read soon.
inline void Prefetch(const void* bytes, std::size_t num_bytes) {
  constexpr std::size_t kCacheLine = 64;
  for (std::size_t i = 0; i < num_bytes; i += kCacheLine) {
    __builtin_prefetch(static_cast<const char*>(bytes) + i);
  }
}

}  // namespace scanloc
