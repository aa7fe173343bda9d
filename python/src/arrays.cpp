#include "arrays.hpp"

#include <cstring>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "errors.hpp"
#include "scanloc/core/limits.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

[[noreturn]] void Refuse(const std::string& text) {
  throw StatusError(absl::InvalidArgumentError(text));
}

std::string Text(const nb::object& object) { return nb::str(object).c_str(); }

std::string TypeText(nb::handle object) { return Text(nb::borrow(object.type())); }

/// What an object is, for who wanted an array of something else.
std::string KindText(nb::handle object) {
  if (!nb::hasattr(object, "dtype")) return TypeText(object);
  return absl::StrCat("an array of ", Text(object.attr("dtype")));
}

/// A masked array holds numbers below its mask, too, which would be taken as they are.
bool IsMasked(nb::handle object) {
  if (!nb::hasattr(object, "mask") || !nb::hasattr(object, "filled")) return false;
  return nb::cast<bool>(nb::bool_(object.attr("mask").attr("any")()));
}

/// Any array that lies in this machine's memory in its own byte order.
nb::ndarray<nb::ro> AnyArray(nb::handle object, const char* name, const char* wanted) {
  nb::ndarray<nb::ro> array;
  if (!nb::try_cast(object, array)) {
    Refuse(absl::StrCat(name, " is ", KindText(object), "; it must be ", wanted));
  }
  if (IsMasked(object)) {
    Refuse(absl::StrCat(name,
                        " has masked elements, which would count as they are; leave them "
                        "out: numpy.ma.compress_rows(",
                        name, ")"));
  }
  return array;
}

std::string ShapeText(const nb::ndarray<nb::ro>& array) {
  std::vector<std::size_t> shape;
  for (std::size_t i = 0; i < array.ndim(); ++i) shape.push_back(array.shape(i));
  return absl::StrCat("(", absl::StrJoin(shape, ", "), ")");
}

double ElementAt(const nb::ndarray<nb::ro>& array, std::int64_t offset) {
  if (array.dtype() == nb::dtype<double>()) return static_cast<const double*>(array.data())[offset];
  return static_cast<const float*>(array.data())[offset];
}

/// Memory that is fresh costs as much as the copy: each thread keeps what it copied to.
thread_local PointCloud spare;

/// x y z of each row, at least one.
void CopyRows(const nb::ndarray<nb::ro>& array, PointCloud& points) {
  const auto* row = static_cast<const float*>(array.data());
  const std::int64_t along_rows = array.stride(0);
  const std::int64_t along_row = array.stride(1);
  points.resize(array.shape(0));
  // What is behind x y z may be read: a fourth column, or where the next row begins.
  const bool is_more_behind = array.shape(1) > 3 || along_rows > 0;
  if (along_row != 1 || !is_more_behind) {
    for (Point& point : points) {
      point = {row[0], row[along_row], row[2 * along_row]};
      row += along_rows;
    }
    return;
  }
  // Four numbers at once, of which the next point overwrites the last.
  auto* const out = reinterpret_cast<char*>(points.data());
  const std::size_t last = points.size() - 1;
  for (std::size_t i = 0; i < last; ++i) {
    std::memcpy(out + i * sizeof(Point), row, 4 * sizeof(float));
    row += along_rows;
  }
  std::memcpy(out + last * sizeof(Point), row, sizeof(Point));
}

constexpr char kPoses[] = "a 4x4 (or 3x4) matrix [R t] of float64";

nb::ndarray<nb::ro> PoseArray(nb::handle matrix, const char* name, std::size_t ndim) {
  nb::ndarray<nb::ro> array = AnyArray(matrix, name, kPoses);
  if (array.dtype() != nb::dtype<double>() && array.dtype() != nb::dtype<float>()) {
    Refuse(absl::StrCat(name, " is not of float64; it must be ", kPoses));
  }
  const bool fits = array.ndim() == ndim && array.shape(ndim - 1) == 4 &&
                    (array.shape(ndim - 2) == 4 || array.shape(ndim - 2) == 3);
  if (!fits) {
    Refuse(absl::StrCat(name, " has the shape ", ShapeText(array), "; it must be ",
                        ndim == 3 ? "N times " : "", kPoses));
  }
  return array;
}

/// The pose whose rows are the last two dimensions.
Pose PoseAt(const nb::ndarray<nb::ro>& array, std::int64_t offset, const std::string& name) {
  const std::size_t rows = array.ndim() - 2;
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (std::size_t r = 0; r < array.shape(rows); ++r) {
    for (std::size_t c = 0; c < 4; ++c) {
      matrix(static_cast<int>(r), static_cast<int>(c)) =
          ElementAt(array, offset + static_cast<std::int64_t>(r) * array.stride(rows) +
                               static_cast<std::int64_t>(c) * array.stride(rows + 1));
    }
  }
  if (!(matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).isZero(1e-9)) {
    Refuse(absl::StrCat(name, ": the last row of a 4x4 pose must be 0 0 0 1"));
  }
  absl::StatusOr<Pose> pose = PoseFromMatrix(matrix.topRows<3>());
  if (!pose.ok()) Refuse(absl::StrCat(name, ": ", pose.status().message()));
  return *pose;
}

}  // namespace

Scan::Scan(nb::handle points)
    : array_(AnyArray(points, "points",
                      "an N x 3 or N x 4 array of float32: numpy.asarray(points, numpy.float32)")) {
  if (array_.device_type() != nb::device::cpu::value) {
    Refuse("points lie on another device; copy them to this machine's memory");
  }
  if (array_.dtype() != nb::dtype<float>()) {
    Refuse(absl::StrCat("points is ", KindText(points),
                        "; it must be of float32: points.astype(numpy.float32)"));
  }
  if (array_.ndim() != 2 || array_.shape(1) < 3 || array_.shape(1) > 64) {
    Refuse(absl::StrCat("points have the shape ", ShapeText(array_),
                        "; it must be (N, 3) or (N, 4): x y z [m] and what else there is, a row "
                        "a point"));
  }
  if (array_.shape(0) > limits::kMaxPointsPerScan) {
    Refuse(absl::StrCat("points have the shape ", ShapeText(array_), "; a scan has at most ",
                        limits::kMaxPointsPerScan, " points"));
  }
}

bool Scan::IsPacked() const {
  return array_.stride(1) == 1 && (array_.stride(0) == 3 || array_.shape(0) == 1);
}

PointView Scan::points() const {
  static_assert(sizeof(Point) == 3 * sizeof(float));
  const std::size_t num_points = array_.shape(0);
  if (num_points == 0) return {};
  if (IsPacked()) return {static_cast<const Point*>(array_.data()), num_points};
  if (copy_.empty()) {
    copy_ = std::move(spare);
    CopyRows(array_, copy_);
  }
  return copy_;
}

PointRows Scan::rows() const {
  const bool are_rows = array_.shape(0) > 1 && array_.stride(1) == 1 && array_.stride(0) >= 3;
  if (are_rows) {
    return {static_cast<const float*>(array_.data()), array_.shape(0),
            static_cast<std::size_t>(array_.stride(0))};
  }
  const PointView packed = points();
  return {reinterpret_cast<const float*>(packed.data()), packed.size(), 3};
}

PointCloud Scan::Take() && {
  const PointView packed = points();
  return copy_.empty() ? PointCloud(packed.begin(), packed.end()) : std::move(copy_);
}

Scan::~Scan() {
  if (copy_.capacity() > spare.capacity()) spare = std::move(copy_);
}

Pose PoseOf(nb::handle matrix, const char* name) {
  return PoseAt(PoseArray(matrix, name, 2), 0, name);
}

std::vector<Pose> PosesOf(nb::handle matrices, const char* name) {
  const nb::ndarray<nb::ro> array = PoseArray(matrices, name, 3);
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < array.shape(0); ++i) {
    poses.push_back(PoseAt(array, static_cast<std::int64_t>(i) * array.stride(0),
                           absl::StrCat(name, "[", i, "]")));
  }
  return poses;
}

Matrix ArrayOf(const Pose& pose) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = pose.matrix();
  return ArrayOf<double, Matrix>({rows.data(), rows.data() + 16}, {4, 4});
}

}  // namespace scanloc::python
