#pragma once

#include <nanobind/nanobind.h>

#include <exception>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "interpreter_lock.hpp"

namespace scanloc::python {

/// A status that is not OK on its way to Python, where it becomes an exception of its kind.
class StatusError : public std::exception {
 public:
  explicit StatusError(absl::Status status)
      : status_(std::move(status)), text_(status_.message()) {}
  [[nodiscard]] const char* what() const noexcept override { return text_.c_str(); }
  [[nodiscard]] absl::StatusCode code() const { return status_.code(); }

 private:
  absl::Status status_;
  std::string text_;
};

inline void OrThrow(const absl::Status& status) {
  if (!status.ok()) throw StatusError(status);
}
template <typename T>
T OrThrow(absl::StatusOr<T> result) {
  if (!result.ok()) throw StatusError(result.status());
  return *std::move(result);
}

/// Runs it with the interpreter's lock released; what it fails with is thrown.
template <typename Work>
auto Unlocked(Work&& work) {
  auto result = [&] {
    const Unlock unlocked;
    return work();
  }();
  return OrThrow(std::move(result));
}

/// Makes StatusErrors exceptions of python/scanloc/errors.py from here on.
void TranslateErrors();

}  // namespace scanloc::python
