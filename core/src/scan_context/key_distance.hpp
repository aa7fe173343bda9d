#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/scan_context/key_index.hpp"

namespace scanloc {

/// Squared distance [m²] of a table's retrieval keys from one, of whole centimetres: the same bits
/// whatever tree they are held in.
class KeyDistance {
 public:
  explicit KeyDistance(std::span<const std::int32_t> key_cm);

  /// Requires keys of that length.
  [[nodiscard]] double Squared(const ContextTable& table, std::size_t entry) const;

 private:
  std::vector<std::int32_t> key_cm_;
  std::vector<std::int32_t> reversed_cm_;
  std::int64_t square_cm2_ = 0;
};

}  // namespace scanloc
