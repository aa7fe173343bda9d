#pragma once

#include <cstddef>
#include <vector>

#include "absl/status/statusor.h"
#include "map/payload_view.hpp"
#include "scanloc/core/answer.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/query.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/scan_context/key_index.hpp"
#include "scanloc/core/scan_context/match.hpp"
#include "scanloc/core/search_control.hpp"

namespace scanloc {

/// The paper's place recognition (Sec. V) by one kind of context.
/// Any number of threads may call Locate at once.
class ContextSearch {
 public:
  /// Builds the k-d trees, but for those that it shares with a search of another map, as KeyIndex
  /// does. Requires that the map holds the kind; keeps a reference to the map.
  ContextSearch(const Map& map, DescriptorKind kind, const ContextSearch* before = nullptr);

  /// Takes in the places that were appended to the map, as KeyIndex::Extend does.
  void Extend() { index_.Extend(); }

  /// The three stages, and the decision. Requires a query that is valid and asks for a method of
  /// this kind. What comes of a search that became unwanted is no answer. The errors of
  /// PayloadReader::Read.
  [[nodiscard]] absl::StatusOr<Answer> Locate(const ScanDescriptor& scan, const Query& query,
                                              const SearchControl& control) const;

 private:
  /// An entry of the table, and how well the query lies on it.
  struct Scored {
    std::size_t entry = 0;
    Match match;
  };

  [[nodiscard]] std::vector<std::size_t> Retrieve(const Keys& keys, const Query& query,
                                                  const Method& method,
                                                  const SearchControl& control) const;
  [[nodiscard]] absl::StatusOr<std::vector<Scored>> Compare(const ContextView& query,
                                                            const std::vector<std::size_t>& entries,
                                                            const Method& method,
                                                            const SearchControl& control) const;
  [[nodiscard]] Candidate CandidateFrom(const Scored& scored, const Structure& query) const;

  [[nodiscard]] std::size_t PlaceOf(std::size_t entry) const {
    return static_cast<std::size_t>(table_.entry(entry).place);
  }

  const Map& map_;
  const DescriptorKind kind_;
  const ContextTable& table_;
  KeyIndex index_;
};

}  // namespace scanloc
