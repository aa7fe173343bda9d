#pragma once

#include "scanloc/proto/messages.hpp"

namespace scanloc {

/// `loading`, `serving` or `failed`.
[[nodiscard]] const char* StateName(MapState state);

}  // namespace scanloc
