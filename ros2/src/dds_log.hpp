#pragma once

#include <cstddef>

namespace scanloc::ros2 {

/// From now on, what DDS itself has to say goes to stderr in lines of ours, of each kind of trouble
/// one in a while; messages that it refuses are counted.
void CatchDdsLog();

/// Messages, of any topic, whose bytes were no message of the topic's type.
[[nodiscard]] std::size_t NumMalformed();

}  // namespace scanloc::ros2
