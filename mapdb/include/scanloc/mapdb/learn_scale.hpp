#pragma once

#include "absl/status/statusor.h"
#include "scanloc/core/params.hpp"
#include "scanloc/mapdb/build_map.hpp"

namespace scanloc::mapdb {

/// The scale (AutoParams::scale) that suits the scans of a drive, found out from a sample of at
/// most 32 of them, evenly over the drive: the same drive, the same scale. 1 where they show
/// nothing. Reads the sample once, or three times where how far they see does not tell.
///
/// What the loader returns as Cancelled is passed on; scans it cannot read are passed over.
[[nodiscard]] absl::StatusOr<double> LearnScale(const Params& params, const SessionPlan& plan,
                                                const ScanLoader& load_scan);

}  // namespace scanloc::mapdb
