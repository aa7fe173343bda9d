#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scanloc/core/scan/descriptor.hpp"

namespace scanloc {

/// The two sub-descriptors of a context (paper, Sec. IV-F), both L1 norms in centimetres.
struct Keys {
  std::vector<std::int32_t> retrieval_cm;  ///< N_R, one per row: unchanged by column shifts
  std::vector<std::int32_t> aligning_cm;   ///< N_A, one per column

  friend bool operator==(const Keys&, const Keys&) = default;
};
[[nodiscard]] Keys MakeKeys(const Context& context);

/// A context and its aligning key, wherever they are held: what matching looks at.
struct ContextView {
  int num_rows = 0;
  int num_cols = 0;
  std::span<const std::uint16_t> cells_cm;
  std::span<const std::int32_t> aligning_cm;
};

/// All contexts of one kind in a map, originals and augmented ones, with their keys; structure of
/// arrays. An entry is one context; the entries of a place share its index and follow each other.
class ContextTable {
 public:
  /// What an entry says of the place.
  struct Entry {
    std::int32_t place = 0;     ///< index of the place in the map
    float root_shift_m = 0.0F;  ///< lateral position of the virtual vehicle, A-PC
    bool flipped = false;       ///< the place as seen by the reversed vehicle, A-CC
    bool augmented = false;     ///< not the place's own context
  };

  ContextTable() = default;
  ContextTable(int num_rows, int num_cols) : num_rows_(num_rows), num_cols_(num_cols) {}

  void Reserve(std::size_t num_entries);

  /// Requires context cells and keys of the table's shape.
  void Append(const Entry& entry, std::span<const std::uint16_t> cells_cm,
              std::span<const std::int32_t> retrieval_cm,
              std::span<const std::int32_t> aligning_cm);

  /// Appends the last entry's double flip (paper, Sec. V-D2), as augmented.
  void AppendFlipOfLast();

  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] int num_rows() const { return num_rows_; }
  [[nodiscard]] int num_cols() const { return num_cols_; }
  [[nodiscard]] const Entry& entry(std::size_t i) const { return entries_[i]; }
  [[nodiscard]] ContextView context(std::size_t i) const;
  [[nodiscard]] std::span<const std::int32_t> retrieval_key_cm(std::size_t i) const;

 private:
  int num_rows_ = 0;
  int num_cols_ = 0;
  std::vector<Entry> entries_;
  std::vector<std::uint16_t> cells_cm_;
  std::vector<std::int32_t> retrieval_cm_;
  std::vector<std::int32_t> aligning_cm_;
};

}  // namespace scanloc
