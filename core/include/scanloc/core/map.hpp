#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scanloc/core/context_table.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/pose.hpp"

namespace scanloc {

/// One place of a map: where the sensor stood when it was mapped.
struct Place {
  Pose T_map_place = Pose::Identity();
  std::int64_t stamp_ns = 0;  ///< when it was mapped; 0 if the drive has no times
  std::int32_t session = 0;   ///< index into Map::sessions
};

/// A map in memory: all that answering a query needs. Read-only once made.
struct Map {
  Params params;
  std::string content_id;             ///< hash over what the map says; traces an answer to its map
  std::vector<std::string> sessions;  ///< names
  std::vector<Place> places;          ///< in the order built
  ContextTable polar;                 ///< empty where the map has no polar contexts
  ContextTable cart;

  /// Appends the contexts, augmented ones included, of the next place. Requires
  /// Validate(descriptor, params).ok() and tables of the parameters' shapes.
  void AppendContexts(std::int32_t place, const PlaceDescriptor& descriptor);
};

/// A map without places, with tables of the right shapes.
[[nodiscard]] Map MakeEmptyMap(const Params& params);

}  // namespace scanloc
