#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "scanloc/core/scan/bearing_grid.hpp"

namespace scanloc {

/// What of a scan stays as it is when the sensor turns, as one vector of small whole numbers: two
/// scans of one place have a large product. Its parts, of unit length times a scale each:
///
/// - of the bearings. Rings are added up to six groups, and a group's 64 sectors are a periodic
///   signal: a turn changes neither the magnitudes of its first frequencies nor by how much its
///   phases are ahead of the next group's;
/// - the retrieval keys of the polar and of the cart context (paper, Sec. IV-F).
class SignatureShape {
 public:
  /// Where a part is; each has whole pairs of numbers, filled up with zeros.
  struct Part {
    std::size_t begin = 0;
    std::size_t size = 0;
  };

  /// Of contexts with so many rows; none: they are no part.
  SignatureShape(int num_polar_rows, int num_cart_rows);

  [[nodiscard]] const Part& bearings() const { return bearings_; }
  [[nodiscard]] const Part& polar() const { return polar_; }
  [[nodiscard]] const Part& cart() const { return cart_; }
  [[nodiscard]] std::size_t size() const { return cart_.begin + cart_.size; }

 private:
  Part bearings_, polar_, cart_;
};

/// Writes the part that bearings say, of a grid that was widened. The scale is at most 127; zeros
/// where nothing stands.
void WriteBearings(const BearingGrid& widened, double scale, std::span<std::int8_t> part);

/// Writes the part that a retrieval key says, likewise.
void WriteKey(std::span<const std::int32_t> retrieval_cm, double scale,
              std::span<std::int8_t> part);

/// Writes values as a part of such a length.
void WriteScaled(std::span<const float> values, double scale, std::span<std::int8_t> part);

}  // namespace scanloc
