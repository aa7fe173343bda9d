#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scanloc/core/map/map.hpp"
#include "scanloc/core/map/shared_blocks.hpp"
#include "scanloc/core/search_control.hpp"
#include "structural/signature_rows.hpp"

namespace scanloc {

/// How many places of so many are worth finding: the larger a map, the more of its places look more
/// alike to a hard scan than its own does.
[[nodiscard]] std::size_t NumToFind(const ShortlistParams& params, std::size_t num_places);

/// A query's bearings from where it is and from the spots aside, the farthest to its right first.
[[nodiscard]] std::vector<BearingGrid> SpotsOf(std::span<const Post> posts,
                                               const ShortlistParams& params);

/// What places have of a query, batch by batch.
struct SignaturesCompared {
  std::vector<SignatureScores> batches;
  std::vector<std::uint32_t> first_places;  // of each batch
};

/// The signatures of a map's places, in their order. Any number of threads may search it.
///
/// Of up to kMaxExact places all are compared. Of more, first runs of some places one behind the
/// other, by what their signatures have in common, then the places of the best ones: what is found
/// depends on the places and their order alone.
class SignatureIndex {
 public:
  static constexpr std::size_t kMaxExact = 32'768;

  /// Keeps a reference to the map. Holds what is equal to a part of another index in its place.
  SignatureIndex(const Map& map, const SignatureIndex* before);

  /// Takes in the places that were appended to the map; O(1) a place, not beside a search.
  void Extend() { Extend(nullptr); }

  /// A query of such bearings, seen from some spots; empty contexts say nothing.
  [[nodiscard]] SignatureQuery QueryOf(std::span<const BearingGrid> spots, const Context& polar,
                                       const Context& cart) const;

  /// A place, and the spot from which its bearings are most alike.
  struct Found {
    std::int32_t place = 0;
    std::size_t spot = 0;
  };
  /// The places with most of a query, that first; of equal ones the lower. Where some are excluded
  /// all others are compared.
  [[nodiscard]] std::vector<Found> MostAlike(const SignatureQuery& query, std::size_t k,
                                             const SearchControl& control) const;

 private:
  /// Some places, as SharedBlocks holds them.
  struct Block {
    SignatureRows places, runs;
    std::size_t num_places = 0;
    std::vector<float> sum;  // of the signatures of the last run

    friend bool operator==(const Block&, const Block&) = default;
  };
  void Extend(const SignatureIndex* before);
  /// Reads the key of the next place's own context, none if it has none.
  static void ReadKey(const ContextTable& table, std::size_t place, std::size_t& next_entry,
                      std::vector<std::int32_t>& retrieval_cm);
  void Append(std::span<const std::int8_t> signature);
  /// Some of the batches of a block.
  struct Part {
    const Block* block;
    std::size_t first_place;  // of the block
    std::size_t begin, end;   // batches
  };
  /// All of the places, in their order; the second half of a small map is empty.
  [[nodiscard]] std::array<std::vector<Part>, 2> Halves() const;
  /// How much of the query the best run of each batch has.
  [[nodiscard]] static std::vector<std::int16_t> BestRuns(std::span<const Part> parts,
                                                          const SignatureQuery& query);
  /// Of the batches whose best run has so much of it, or of all where there are no runs, what
  /// places have of the query.
  [[nodiscard]] static SignaturesCompared CompareAll(std::span<const Part> parts,
                                                     const SignatureQuery& query,
                                                     std::span<const std::int16_t> best_runs,
                                                     std::int16_t least_run,
                                                     const std::vector<bool>* excluded);

  const Map& map_;
  SignatureShape shape_;
  SharedBlocks<Block> blocks_;
  std::size_t next_polar_ = 0;  // entry of the context's table
  std::size_t next_cart_ = 0;
};

}  // namespace scanloc
