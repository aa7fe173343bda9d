#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

/// Numbers as they stand in files and messages, on any machine and at any address.
namespace scanloc {

/// The number whose sizeof(Number) bytes stand there in that order.
template <typename Number>
[[nodiscard]] Number LoadNumber(const void* bytes, std::endian order = std::endian::little) {
  std::array<std::byte, sizeof(Number)> raw;
  std::memcpy(raw.data(), bytes, raw.size());
  if (order != std::endian::native) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<Number>(raw);
}

/// Writes sizeof(Number) bytes, the least significant first.
template <typename Number>
void StoreLittleEndian(Number value, void* bytes) {
  auto raw = std::bit_cast<std::array<std::byte, sizeof(Number)>>(value);
  if constexpr (std::endian::native != std::endian::little) std::reverse(raw.begin(), raw.end());
  std::memcpy(bytes, raw.data(), raw.size());
}

}  // namespace scanloc
