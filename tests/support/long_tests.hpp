#pragma once

#include <cstdlib>
#include <string_view>

namespace scanloc::test {

/// Whether tests shall take the time for their long variants: $SCANLOC_LONG_TESTS is 1. The short
/// ones do the same things less often, or for less long.
inline bool LongTests() {
  const char* wanted = std::getenv("SCANLOC_LONG_TESTS");
  return wanted != nullptr && std::string_view(wanted) == "1";
}

}  // namespace scanloc::test
