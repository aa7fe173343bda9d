#include "errors.hpp"

#include <string_view>

namespace nb = nanobind;

namespace scanloc::python {
namespace {

/// Of the class in python/scanloc/errors.py.
const char* NameOf(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kInvalidArgument:
      return "InvalidArgument";
    case absl::StatusCode::kNotFound:
      return "NotFound";
    case absl::StatusCode::kAlreadyExists:
      return "AlreadyExists";
    case absl::StatusCode::kFailedPrecondition:
      return "FailedPrecondition";
    case absl::StatusCode::kDataLoss:
      return "DataLoss";
    case absl::StatusCode::kUnavailable:
      return "Unavailable";
    case absl::StatusCode::kResourceExhausted:
      return "ResourceExhausted";
    case absl::StatusCode::kDeadlineExceeded:
      return "DeadlineExceeded";
    case absl::StatusCode::kUnauthenticated:
      return "Unauthenticated";
    case absl::StatusCode::kPermissionDenied:
      return "PermissionDenied";
    case absl::StatusCode::kCancelled:
      return "Cancelled";
    case absl::StatusCode::kUnimplemented:
      return "Unimplemented";
    default:
      return "Error";
  }
}

}  // namespace

void TranslateErrors() {
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const StatusError& error) {
      const nb::object kind = nb::module_::import_("scanloc.errors").attr(NameOf(error.code()));
      // Names of files may be no UTF-8.
      const std::string_view text = error.what();
      const nb::object what = nb::steal(PyUnicode_DecodeUTF8(
          text.data(), static_cast<Py_ssize_t>(text.size()), "surrogateescape"));
      PyErr_SetObject(kind.ptr(), what.ptr());
    }
  });
}

}  // namespace scanloc::python
