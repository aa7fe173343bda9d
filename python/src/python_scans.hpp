#pragma once

#include <nanobind/nanobind.h>

#include <atomic>
#include <exception>
#include <utility>

#include "absl/status/statusor.h"
#include "arrays.hpp"
#include "errors.hpp"
#include "interpreter_lock.hpp"

namespace scanloc::python {

/// Scans that Python keeps: a sequence of arrays, or a function of their number. Threads of
/// scanloc read them; what Python raises meanwhile ends the work and is raised again at its end.
class PythonScans {
 public:
  explicit PythonScans(nanobind::object scans) : scans_(std::move(scans)) {}

  absl::StatusOr<PointCloud> operator()(std::size_t number) {
    PointCloud points;
    Call([&] {
      const nanobind::object given =
          PyCallable_Check(scans_.ptr()) != 0 ? scans_(number) : nanobind::object(scans_[number]);
      points = Scan(given).Take();
    });
    if (raised()) return absl::CancelledError("Python raised an exception");
    return points;
  }

  /// Calls into Python, Ctrl-C first: between the steps of long work. Nothing once it has raised.
  template <typename Work>
  void Call(Work&& work) {
    const Lock locked;
    if (raised_) return;
    try {
      // Of no effect but on the thread that Python handles signals on.
      if (PyErr_CheckSignals() != 0) throw nanobind::python_error();
      work();
    } catch (...) {
      raised_ = std::current_exception();
      has_raised_ = true;
    }
  }

  /// Any thread.
  [[nodiscard]] bool raised() const { return has_raised_; }

  /// With the interpreter's lock held, after the work is done.
  void Rethrow() {
    if (raised_) std::rethrow_exception(std::exchange(raised_, nullptr));
  }

 private:
  nanobind::object scans_;
  std::exception_ptr raised_;  // guarded by the interpreter's lock
  std::atomic<bool> has_raised_ = false;
};

/// As Unlocked; what calls into Python raised goes before what the work made of it.
template <typename Work>
auto UnlockedReading(PythonScans& scans, Work&& work) {
  auto result = [&] {
    const Unlock unlocked;
    return work();
  }();
  scans.Rethrow();
  return OrThrow(std::move(result));
}

}  // namespace scanloc::python
