#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "scanloc/core/map/context_table.hpp"

namespace scanloc {

/// What the distance between retrieval keys is taken of.
enum class KeyScale : std::uint8_t {
  kMetres = 0,  ///< the keys as they are (the paper)
  kUnit = 1,    ///< keys scaled to unit L2 norm: insensitive to how much of the scene a scan saw
};

/// How much of an index is looked at; by default all that an exact search needs.
struct KeyEffort {
  static constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
  /// Keys that are looked at roughly, those of the nearest parts of the index first.
  std::size_t max_scanned = kAll;
  /// Of these, the nearest by their leading components, which are compared in full.
  std::size_t max_compared = kAll;  ///< at least 1
};

/// What is worth it to find k of so many places, if what is found is chosen from by other means:
/// all in maps of kMaxExactPlaces, in larger ones the keys scanned grow with the map, but slower.
inline constexpr std::size_t kMaxExactPlaces = 20'000;
[[nodiscard]] KeyEffort EffortFor(std::size_t num_places, int k);

/// How many of so many places are worth finding, of kMaxExactPlaces k: the larger a map, the more
/// of its places have keys nearer to a hard scan's than its own place has.
[[nodiscard]] int NumToFind(std::size_t num_places, int k);

class KeyTree;

/// All retrieval keys of a table, original and augmented, in a k-d tree (paper, Sec. V-A, V-D) for
/// each full block of keys (ContextTable::key_blocks) and one for those behind these; in several
/// where the table grew since. They are searched as one. What an exact search finds does not depend
/// on which trees there are. Any number of threads may search it.
class KeyIndex {
 public:
  struct Neighbor {
    std::size_t entry = 0;      ///< of the table
    double key_distance = 0.0;  ///< L2 between retrieval keys, [m] for KeyScale::kMetres
  };

  /// O(n log n). Keeps a reference to the table. Blocks that the table shares with that of another
  /// index of the scale have their trees from there, which are the same bit for bit.
  explicit KeyIndex(const ContextTable& table, KeyScale scale = KeyScale::kMetres,
                    const KeyIndex* before = nullptr);
  KeyIndex(KeyIndex&&) noexcept;
  KeyIndex& operator=(KeyIndex&&) noexcept;
  ~KeyIndex();

  /// Takes in what was appended to the table. Entries are found without that, too, but each at the
  /// cost of a comparison. Amortised O(log² n) an entry; not beside a search.
  void Extend();

  /// The entries of the k places nearest by retrieval key, one entry a place (its nearest), nearest
  /// first; fewer if the table has fewer places. Ties go to the lower entry. With augmented false,
  /// augmented entries are passed over, and so are, where `excluded` is given, the places whose
  /// element in it is true.
  ///
  /// With less than all effort some may be missing, and others be there instead: which ones
  /// depends on how the table grew within its last block, not on threads.
  [[nodiscard]] std::vector<Neighbor> Search(std::span<const std::int32_t> retrieval_cm, int k,
                                             bool augmented,
                                             const std::vector<bool>* excluded = nullptr,
                                             const KeyEffort& effort = {}) const;

  /// The tree of a full block that another table shares; null if it is not shared or has no tree
  /// here.
  [[nodiscard]] std::shared_ptr<const KeyTree> TreeOf(const ContextTable& other,
                                                      std::size_t block) const;

 private:
  struct Trees;
  void Grow(const KeyIndex* before);
  std::unique_ptr<Trees> trees_;
};

}  // namespace scanloc
