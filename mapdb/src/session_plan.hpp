#pragma once

#include <string>
#include <vector>

#include "checksum.hpp"
#include "scanloc/mapdb/map_builder.hpp"

namespace scanloc::mapdb {

/// Hash of a plan, by which a resumed build knows it again.
[[nodiscard]] std::string PlanHash(const SessionPlan& plan);

/// Why the plan is not the one that a session was built of, as far as its committed places tell.
[[nodiscard]] std::string DescribeDifference(const SessionRow& stored,
                                             const std::vector<PlaceRow>& places,
                                             const SessionPlan& plan);

}  // namespace scanloc::mapdb
