#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scanloc/core/scan_context/key_index.hpp"

namespace scanloc {

/// Turns keys onto the principal axes of the map's keys, greatest variance first.
///
/// Distances stay as they are, but the rows of keys go up and down together: along these axes the
/// tree cuts where keys differ, and most distances are known to be too great after a few terms.
class PrincipalAxes {
 public:
  /// Of the keys of some entries.
  PrincipalAxes(const ContextTable& table, std::span<const std::size_t> entries);

  /// The components of a key along the first axes [m]. Returns its length.
  double Turn(std::span<const std::int32_t> key_cm, std::span<float> components) const;

 private:
  Eigen::MatrixXd axes_;  // one a row
};

}  // namespace scanloc
