#pragma once

#include <nanobind/nanobind.h>

/// What the module is put together of; each adds classes and functions to it.
namespace scanloc::python {

void BindParams(nanobind::module_& m);
void BindAnswers(nanobind::module_& m);
void BindQueries(nanobind::module_& m);
void BindStreams(nanobind::module_& m);
void BindMap(nanobind::module_& m);
void BindLocalizer(nanobind::module_& m);
void BindLoopDetector(nanobind::module_& m);
void BindClient(nanobind::module_& m);
void BindEvaluation(nanobind::module_& m);

}  // namespace scanloc::python
