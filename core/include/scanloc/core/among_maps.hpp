#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "scanloc/core/answer.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/query.hpp"

namespace scanloc {

/// What one of several maps says of a scan that all of them are asked about.
struct MapAnswer {
  std::string map;            ///< its name
  Params params = {};         ///< of the map
  std::size_t num_posts = 0;  ///< of the scan's structure as the map's parameters make it
  Answer answer;              ///< to the query, by this map alone
};

/// Out of what several maps say of one scan, what is said of it: as if they were one map whose
/// parts lie far apart.
///
/// With `auto`, a spot of one map is a rival to those of all others: each confidence becomes less
/// by the share that the spots of other maps have, and an answer whose confidence is then too low
/// is ambiguous. With the paper's methods, a scan that two maps recognise is ambiguous. Told is the
/// map with the best candidate, with the candidates of all, best first and at most
/// query.max_answers, each with the name of its map; equal ones in the order given. Times are sums.
/// Requires one answer or more, all to the query and by the same method, of maps that differ.
[[nodiscard]] MapAnswer AmongMaps(std::vector<MapAnswer> answers, const Query& query);

}  // namespace scanloc
