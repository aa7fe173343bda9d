#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace scanloc::server {

/// A certificate that trusts in itself, and its key, as PEM texts.
struct OwnIdentity {
  std::string cert;
  std::string key;
};

/// Makes one of which nobody else has the key, valid whatever the clock says: the server shows it
/// when it asks itself, where clients must show a certificate.
[[nodiscard]] absl::StatusOr<OwnIdentity> MakeOwnIdentity();

}  // namespace scanloc::server
