#include "bindings.hpp"
#include "errors.hpp"

NB_MODULE(_scanloc, m) {
  // Threads that run when the program ends keep what they use; that is no fault of whoever wrote
  // it.
  nanobind::set_leak_warnings(false);
  m.doc() = "scanloc: where a LiDAR scan was taken.";
  m.attr("__version__") = SCANLOC_VERSION;
  scanloc::python::TranslateErrors();
  scanloc::python::BindParams(m);
  scanloc::python::BindQueries(m);
  scanloc::python::BindAnswers(m);
  scanloc::python::BindStreams(m);
  scanloc::python::BindMap(m);
  scanloc::python::BindLocalizer(m);
  scanloc::python::BindLoopDetector(m);
  scanloc::python::BindClient(m);
  scanloc::python::BindEvaluation(m);
}
