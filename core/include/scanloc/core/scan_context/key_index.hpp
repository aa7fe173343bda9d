#pragma once

#include <cstddef>
#include <cstdint>
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

/// One k-d tree over all retrieval keys of a table, original and augmented (paper, Sec. V-A, V-D).
/// Immutable; any number of threads may search it. Holds its own copy of the keys.
class KeyIndex {
 public:
  struct Neighbor {
    std::size_t entry = 0;      ///< of the table
    double key_distance = 0.0;  ///< L2 between retrieval keys, [m] for KeyScale::kMetres
  };

  /// O(n log n).
  explicit KeyIndex(const ContextTable& table, KeyScale scale = KeyScale::kMetres);
  KeyIndex(KeyIndex&&) noexcept;
  KeyIndex& operator=(KeyIndex&&) noexcept;
  ~KeyIndex();

  /// The entries of the k places nearest by retrieval key, one entry a place (its nearest), nearest
  /// first; fewer if the table has fewer places. Ties go to the lower entry. With augmented false,
  /// augmented entries are passed over, and so are, where `excluded` is given, the places whose
  /// element in it is true.
  [[nodiscard]] std::vector<Neighbor> Search(std::span<const std::int32_t> retrieval_cm, int k,
                                             bool augmented,
                                             const std::vector<bool>* excluded = nullptr) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace scanloc
