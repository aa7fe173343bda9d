#include "errors.hpp"

#include <string_view>
#include <utility>

namespace nb = nanobind;

namespace scanloc::python {
namespace {

/// Of the class in python/scanloc/errors.py.
constexpr std::pair<absl::StatusCode, const char*> kNames[] = {
    {absl::StatusCode::kInvalidArgument, "InvalidArgument"},
    {absl::StatusCode::kNotFound, "NotFound"},
    {absl::StatusCode::kAlreadyExists, "AlreadyExists"},
    {absl::StatusCode::kFailedPrecondition, "FailedPrecondition"},
    {absl::StatusCode::kDataLoss, "DataLoss"},
    {absl::StatusCode::kUnavailable, "Unavailable"},
    {absl::StatusCode::kResourceExhausted, "ResourceExhausted"},
    {absl::StatusCode::kDeadlineExceeded, "DeadlineExceeded"},
    {absl::StatusCode::kUnauthenticated, "Unauthenticated"},
    {absl::StatusCode::kPermissionDenied, "PermissionDenied"},
    {absl::StatusCode::kCancelled, "Cancelled"},
    {absl::StatusCode::kUnimplemented, "Unimplemented"}};
const char* NameOf(absl::StatusCode code) {
  for (const auto& [named, name] : kNames) {
    if (named == code) return name;
  }
  return "Error";
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
