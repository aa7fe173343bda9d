#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "scanloc/core/structural/consistency.hpp"

namespace scanloc {

/// A mistake that would explain how poses and scans differ.
struct PoseMistake {
  std::string cause;           ///< for a person; empty where none does
  std::size_t num_better = 0;  ///< pairs that fit clearly better without it
  std::size_t num_worse = 0;
};

/// Lays the poses, with each of the mistakes undone that they are often made with, beside what the
/// scans of the pairs show: the simplest that fits best, if twice as many pairs at least speak for
/// it as against it, of those that tell it from the poses as they are, and most of all pairs fit.
[[nodiscard]] PoseMistake LikelyMistake(std::span<const PairCheck> checks,
                                        std::span<const Pose> poses);

}  // namespace scanloc
