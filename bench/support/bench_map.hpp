#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/descriptor.hpp"

namespace scanloc::bench {

/// A map of a long simulated drive, and queries from another session of the same town.
struct BenchMap {
  Params params;
  std::string path;  ///< of the map file, in the temporary folder; made anew by every process
  std::vector<ScanDescriptor> queries;
};

/// Simulates the drive and builds the map: about a minute for 20,000 places on two cores. Done once
/// a process; on failure ends the process with the reason.
const BenchMap& LargeMap();

/// Places of LargeMap: 20,000, or $SCANLOC_BENCH_PLACES.
std::size_t NumPlaces();

}  // namespace scanloc::bench
