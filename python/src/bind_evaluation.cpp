#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "arrays.hpp"
#include "bindings.hpp"
#include "python_map.hpp"
#include "python_scans.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/eval/evaluation.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

using eval::MethodResult;

std::vector<eval::EvalQuery> QueriesOf(const std::vector<Pose>& truth, std::size_t num_scans) {
  std::vector<eval::EvalQuery> queries;
  for (std::size_t i = 0; i < num_scans; ++i) {
    eval::EvalQuery& query = queries.emplace_back();
    query.name = absl::StrCat("scan-", i);
    if (i < truth.size()) query.T_map_true = truth[i];
  }
  return queries;
}

auto CurveOf(const MethodResult& result, double eval::OperatingPoint::*value) {
  std::vector<double> values;
  for (const eval::OperatingPoint& point : result.precision_recall.points) {
    values.push_back(point.*value);
  }
  const std::size_t size = values.size();
  return ArrayOf(std::move(values), {size});
}

}  // namespace

void BindEvaluation(nb::module_& m) {
  nb::class_<eval::OutcomeCounts>(
      m, "OutcomeCounts", "Answers by outcome; right: within 1 m, 1 m of height and 10 deg.")
      .def_ro("num_queries", &eval::OutcomeCounts::num_queries)
      .def_ro("num_localized", &eval::OutcomeCounts::num_localized)
      .def_ro("num_ambiguous", &eval::OutcomeCounts::num_ambiguous)
      .def_ro("num_not_recognized", &eval::OutcomeCounts::num_not_recognized)
      .def_ro("num_insufficient", &eval::OutcomeCounts::num_insufficient)
      .def_ro("num_pose_right", &eval::OutcomeCounts::num_pose_right)
      .def_ro("num_localized_right", &eval::OutcomeCounts::num_localized_right)
      .def_ro("num_false", &eval::OutcomeCounts::num_false, "Localized and not right.");

  nb::class_<MethodResult>(m, "MethodResult", "What one method is worth.")
      .def_ro("name", &MethodResult::name)
      .def_ro("outcomes", &MethodResult::outcomes)
      .def_prop_ro(
          "precision",
          [](const MethodResult& r) { return CurveOf(r, &eval::OperatingPoint::precision); },
          nb::rv_policy::move,
          "float64, from the highest threshold to the lowest; with recall, the paper's curve.")
      .def_prop_ro(
          "recall", [](const MethodResult& r) { return CurveOf(r, &eval::OperatingPoint::recall); },
          nb::rv_policy::move)
      .def_prop_ro("f1_max", [](const MethodResult& r) { return r.precision_recall.f1_max; })
      .def_prop_ro(
          "area", [](const MethodResult& r) { return r.precision_recall.area; }, "Under the curve.")
      .def_prop_ro("recall_at_full_precision", [](const MethodResult& r) {
        return r.precision_recall.recall_at_full_precision;
      });

  m.def(
      "evaluate",
      [](const PythonMap& map, nb::object given, nb::handle T_map_true,
         const std::vector<std::string>& methods, double within_m, int num_threads) {
        const std::vector<Pose> truth = PosesOf(T_map_true, "T_map_true");
        const std::size_t num_scans = nb::hasattr(given, "__len__") ? nb::len(given) : truth.size();
        if (num_scans != truth.size()) {
          throw StatusError(absl::InvalidArgumentError(absl::StrCat(
              "there are ", num_scans, " scans; T_map_true has ", truth.size(), " poses")));
        }
        if (!(within_m > 0.0)) {
          throw StatusError(absl::InvalidArgumentError(
              absl::StrCat("within_m is ", within_m, "; it must be above 0")));
        }
        if (num_threads < 0 || num_threads > 256) {
          throw StatusError(absl::InvalidArgumentError(
              absl::StrCat("num_threads is ", num_threads, "; it must be in [0, 256]")));
        }
        PythonScans scans(std::move(given));
        eval::EvalOptions options;
        for (const std::string& method : methods) {
          options.methods.push_back(OrThrow(eval::ParseEvalMethod(method)));
          OrThrow(eval::CheckServes(map.map->params, options.methods.back()));
          if (options.methods.back().is_baseline) {
            throw StatusError(absl::InvalidArgumentError(
                absl::StrCat(method, " is a baseline: `scanloc eval` compares with these")));
          }
        }
        options.within_m = {within_m};
        options.num_threads = num_threads;
        options.num_timed = 0;
        options.read_query = [&](std::size_t i) { return scans(i); };
        return UnlockedReading(scans, [&]() -> absl::StatusOr<std::vector<MethodResult>> {
          ASSIGN_OR_RETURN(const auto localizer, Localizer::Create(map.map));
          std::vector<eval::EvalQuery> queries = QueriesOf(truth, num_scans);
          eval::FindRevisits(*map.map, within_m, &queries);
          return eval::Evaluate(*localizer, queries, options,
                                [&](std::size_t) { scans.Call([] {}); });
        });
      },
      nb::arg("map"), nb::arg("scans"), nb::arg("T_map_true").none(),
      nb::arg("methods") = std::vector<std::string>{"auto"}, nb::arg("within_m") = 8.0,
      nb::arg("num_threads") = 0,
      nb::sig("def evaluate(map: Map, scans: collections.abc.Sequence[numpy.typing.ArrayLike] | "
              "collections.abc.Callable[[int], numpy.typing.ArrayLike], T_map_true: "
              "numpy.typing.ArrayLike, methods: collections.abc.Sequence[str] = ['auto'], "
              "within_m: float = 8.0, num_threads: int = 0) -> list[MethodResult]"),
      "How well methods recognise scans of known poses. scans: N arrays, or a function of the "
      "number. T_map_true: N x 4 x 4 [m]. methods: 'auto', 'a-pc', 'a-pc:10' (k = 10), ... "
      "within_m: a place this near makes a query a revisit, and a match right.");
}

}  // namespace scanloc::python
