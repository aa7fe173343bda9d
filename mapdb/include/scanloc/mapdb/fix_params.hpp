#pragma once

#include "absl/status/status.h"
#include "scanloc/mapdb/build_map.hpp"

namespace scanloc::mapdb {

struct FixOptions {
  bool resume = false;  ///< go on with a build of the same plan that was stopped, if there is one
  bool learn_scale = false;  ///< of a new map that holds structures, in place of that of the params
};

/// Completes the parameters and the mode of a build before it begins: options.mode is kCreate, or
/// kAppend, which takes the parameters of the map.
///
/// A build that is resumed goes on with what it had begun with; one that left nothing begins anew.
/// Errors are those of LearnScale; with kAppend, those of ReadInfo and RecoverMap, too.
[[nodiscard]] absl::Status FixParams(const FixOptions& how, const SessionPlan& plan,
                                     const ScanLoader& load_scan, BuildOptions& options);

}  // namespace scanloc::mapdb
