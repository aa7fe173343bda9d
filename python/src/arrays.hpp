#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"

/// numpy arrays from and to scanloc's types. What does not fit is thrown as InvalidArgument, which
/// names the array, what it is and what it should be.
namespace scanloc::python {

/// A scan that Python lent for a call: N×k of float32. N×3 in one piece is looked at where it lies;
/// of others x y z of each row are copied where points are asked for one behind the other.
class Scan {
 public:
  explicit Scan(nanobind::handle points);
  ~Scan();
  Scan(const Scan&) = delete;
  Scan& operator=(const Scan&) = delete;

  [[nodiscard]] PointView points() const;
  [[nodiscard]] PointCloud Take() &&;
  /// Not copied where each row is in one piece and in front of the next.
  [[nodiscard]] PointRows rows() const;

 private:
  [[nodiscard]] bool IsPacked() const;

  nanobind::ndarray<nanobind::ro> array_;  // keeps the points alive
  mutable PointCloud copy_;                // made when asked for
};

/// A 4×4 or 3×4 matrix of float64 or float32.
[[nodiscard]] Pose PoseOf(nanobind::handle matrix, const char* name);
/// N×4×4 or N×3×4.
[[nodiscard]] std::vector<Pose> PosesOf(nanobind::handle matrices, const char* name);

using Matrix =
    nanobind::ndarray<nanobind::numpy, double, nanobind::shape<4, 4>, nanobind::c_contig>;
[[nodiscard]] Matrix ArrayOf(const Pose& pose);

/// An array of its own memory, in row-major order.
template <typename T, typename Array = nanobind::ndarray<nanobind::numpy, T, nanobind::c_contig>>
[[nodiscard]] Array ArrayOf(std::vector<T> values, std::initializer_list<std::size_t> shape) {
  auto* kept = new std::vector<T>(std::move(values));
  nanobind::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return Array(kept->data(), shape, owner);
}

}  // namespace scanloc::python
