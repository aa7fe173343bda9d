#pragma once

#include <array>
#include <vector>

#include "scanloc/core/scan/pose.hpp"

namespace scanloc {

/// Where some places stand and which way they look.
class Stands {
 public:
  /// Keeps a reference to the pose.
  void Add(const Pose& pose);

  /// Whether any is nearer than that and looks the same way, by some 45°: who looks another way
  /// sees other things.
  [[nodiscard]] bool IsAnyBeside(const Pose& pose, double apart_m) const;

 private:
  std::array<std::vector<double>, 3> at_m_;  // axis by axis
  std::vector<const Pose*> poses_;
};

}  // namespace scanloc
