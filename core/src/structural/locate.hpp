#pragma once

#include "absl/status/statusor.h"
#include "scanloc/core/answer.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/query.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/search_control.hpp"
#include "structural/auto_search.hpp"

namespace scanloc {

/// The method `auto` (docs/algorithm.md, "Beyond the paper"): from verified hypotheses to an
/// answer. Requires a query that is valid. What comes of a search that became unwanted is no
/// answer. The errors of PayloadReader::Read.
[[nodiscard]] absl::StatusOr<Answer> LocateByStructure(const Map& map, const AutoSearch& search,
                                                       const ScanDescriptor& scan,
                                                       const Query& query,
                                                       const SearchControl& control);

}  // namespace scanloc
