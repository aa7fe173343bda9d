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

/// All retrieval keys of a table, original and augmented, in one k-d tree (paper, Sec. V-A, V-D);
/// in several where the table grew since. What is found does not depend on which. Any number of
/// threads may search it.
class KeyIndex {
 public:
  struct Neighbor {
    std::size_t entry = 0;      ///< of the table
    double key_distance = 0.0;  ///< L2 between retrieval keys, [m] for KeyScale::kMetres
  };

  /// O(n log n). Keeps a reference to the table.
  explicit KeyIndex(const ContextTable& table, KeyScale scale = KeyScale::kMetres);
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
  [[nodiscard]] std::vector<Neighbor> Search(std::span<const std::int32_t> retrieval_cm, int k,
                                             bool augmented,
                                             const std::vector<bool>* excluded = nullptr) const;

 private:
  struct Trees;
  std::unique_ptr<Trees> trees_;
};

}  // namespace scanloc
