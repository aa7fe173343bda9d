#pragma once

#include <cstdint>

namespace scanloc::ros2 {

/// Datagrams that the kernel dropped since this process opened its sockets, because they came
/// faster than they were taken up; 0 where the kernel does not tell.
[[nodiscard]] std::uint64_t NumDroppedDatagrams();

/// Largest buffer of a socket that the kernel gives [bytes]; 0 where it does not tell.
[[nodiscard]] std::uint64_t LargestReceiveBuffer_bytes();

}  // namespace scanloc::ros2
