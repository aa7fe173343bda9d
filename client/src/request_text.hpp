#pragma once

#include <google/protobuf/message.h>

#include "absl/status/status.h"

namespace scanloc::client {

/// InvalidArgument: a text in the request is no UTF-8. Protobuf would print an error of its own,
/// send it all the same, and the server could not read it.
[[nodiscard]] absl::Status CheckTexts(const google::protobuf::Message& request);

}  // namespace scanloc::client
