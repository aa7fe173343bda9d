#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "scanloc/core/map/context_table.hpp"

namespace scanloc {

class KeyTree;

/// All retrieval keys of a table, original and augmented, in a k-d tree (paper, Sec. V-A, V-D) for
/// each full block of keys (ContextTable::key_blocks) and one for those behind these; in several
/// where the table grew since. They are searched as one; what is found does not depend on which
/// trees there are. Any number of threads may search it.
class KeyIndex {
 public:
  struct Neighbor {
    std::size_t entry = 0;      ///< of the table
    double key_distance = 0.0;  ///< L2 between retrieval keys [m]
  };

  /// O(n log n). Keeps a reference to the table. Blocks that the table shares with that of another
  /// index have their trees from there, which are the same bit for bit.
  explicit KeyIndex(const ContextTable& table, const KeyIndex* before = nullptr);
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
