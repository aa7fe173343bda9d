#pragma once

#include <nanobind/nanobind.h>

#include <exception>
#include <mutex>
#include <utility>

#include "absl/status/statusor.h"
#include "arrays.hpp"
#include "errors.hpp"

namespace scanloc::python {

/// Scans that Python keeps: a sequence of arrays, or a function of their number. Threads of
/// scanloc read them; what Python raises meanwhile ends the work and is raised again at its end.
class PythonScans {
 public:
  explicit PythonScans(nanobind::object scans) : scans_(std::move(scans)) {}

  absl::StatusOr<PointCloud> operator()(std::size_t number) {
    nanobind::gil_scoped_acquire locked;
    try {
      const nanobind::object points =
          PyCallable_Check(scans_.ptr()) != 0 ? scans_(number) : nanobind::object(scans_[number]);
      return Scan(points).Take();
    } catch (...) {
      if (!raised_) raised_ = std::current_exception();
      return absl::CancelledError("reading a scan raised an exception");
    }
  }

  /// With the interpreter's lock held, after the work is done.
  void Rethrow() {
    if (raised_) std::rethrow_exception(std::exchange(raised_, nullptr));
  }

 private:
  nanobind::object scans_;
  std::exception_ptr raised_;  // guarded by the interpreter's lock
};

/// As Unlocked; what reading the scans raised goes before what the work made of it.
template <typename Work>
auto UnlockedReading(PythonScans& scans, Work&& work) {
  auto result = [&] {
    nanobind::gil_scoped_release unlocked;
    return work();
  }();
  scans.Rethrow();
  return OrThrow(std::move(result));
}

}  // namespace scanloc::python
