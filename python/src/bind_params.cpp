#include <nanobind/operators.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <functional>
#include <string>
#include <type_traits>

#include "absl/strings/str_cat.h"
#include "bindings.hpp"
#include "errors.hpp"
#include "scanloc/core/params.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

/// One parameter, by the name that `scanloc info --json` has for it.
template <typename T>
nb::object FieldOf(const T& field) {
  if constexpr (std::is_enum_v<T>) {
    return nb::int_(static_cast<int>(field));
  } else {
    return nb::cast(field);
  }
}

template <typename T>
void SetField(const std::string& name, nb::handle value, T& field) {
  try {
    if constexpr (std::is_enum_v<T>) {
      const int number = nb::cast<int>(value);
      if (number != 0 && number != 1) throw nb::cast_error();
      field = static_cast<T>(number);
    } else {
      field = nb::cast<T>(value);
    }
  } catch (const nb::cast_error&) {
    throw StatusError(absl::InvalidArgumentError(
        absl::StrCat("the parameter ", name, " is ", nb::cast<std::string>(nb::repr(value)),
                     "; it must be of the type of its default, ",
                     nb::cast<std::string>(nb::repr(FieldOf(field))))));
  }
}

void Set(Params& params, const std::string& name, nb::handle value) {
  bool is_known = false;
  VisitFields(params, [&](const char* known, auto& field) {
    if (name != known) return;
    is_known = true;
    SetField(name, value, field);
  });
  if (!is_known) {
    throw StatusError(absl::InvalidArgumentError(
        absl::StrCat("there is no parameter ", name, "; Params().to_dict() lists them")));
  }
}

Params FromDict(const nb::dict& values) {
  Params params;
  for (const auto& [name, value] : values) {
    Set(params, nb::cast<std::string>(nb::str(name)), value);
  }
  OrThrow(Validate(params));
  return params;
}

nb::dict ToDict(const Params& params) {
  nb::dict values;
  VisitFields(params, [&](const char* name, const auto& field) { values[name] = FieldOf(field); });
  return values;
}

}  // namespace

void BindParams(nb::module_& m) {
  nb::class_<Params>(m, "Params",
                     "The parameters of a map, immutable. Names and defaults are those of "
                     "`scanloc info --json`; Params().to_dict() lists them.")
      .def(nb::new_([](const nb::dict& values) { return FromDict(values); }),
           nb::arg("values") = nb::dict(),
           "Defaults, but for those given: Params({'voxel_size_m': 0.4, 'polar.num_rings': 20}).")
      .def("to_dict", &ToDict, "All parameters by name.")
      .def(
          "__getitem__",
          [](const Params& params, const std::string& name) -> nb::object {
            const nb::dict values = ToDict(params);
            if (!values.contains(name.c_str())) throw nb::key_error(name.c_str());
            return values[name.c_str()];
          },
          nb::arg("name"))
      .def_prop_ro("signature", &DescriptorSignature,
                   "Equal exactly where descriptors made with two parameter sets are comparable.")
      .def(nb::self == nb::self, nb::sig("def __eq__(self, arg: object, /) -> bool"))
      .def("__hash__",
           [](const Params& params) {
             return std::hash<std::string>()(DescriptorSignature(params));
           })
      .def("__repr__", [](const Params& params) {
        return absl::StrCat("Params(", nb::cast<std::string>(nb::repr(ToDict(params))), ")");
      });
}

}  // namespace scanloc::python
