#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>

#include "absl/strings/str_cat.h"
#include "arrays.hpp"
#include "bindings.hpp"
#include "scanloc/core/answer.hpp"

namespace nb = nanobind;

namespace scanloc::python {

void BindAnswers(nb::module_& m) {
  nb::enum_<Outcome>(m, "Outcome", "What is said of a scan.")
      .value("LOCALIZED", Outcome::kLocalized, "It was taken at T_map_query.")
      .value("AMBIGUOUS", Outcome::kAmbiguous, "Two distinct places explain it.")
      .value("NOT_RECOGNIZED", Outcome::kNotRecognized, "Out of the map, or changed too much.")
      .value("INSUFFICIENT_SCAN", Outcome::kInsufficientScan, "Too few points to say anything.");

  nb::class_<Candidate>(m, "Candidate", "One place that a scan may have been taken at.")
      .def_ro("place", &Candidate::place, "Index in the map, from 0.")
      .def_ro("session", &Candidate::session, "Index of the place's session.")
      .def_ro("session_name", &Candidate::session_name)
      .def_ro("distance", &Candidate::distance, "In [0, 1]; smaller is more alike.")
      .def_ro("confidence", &Candidate::confidence,
              "Probability that T_map_query is right; None but with the method auto.")
      .def_ro("yaw_rad", &Candidate::yaw_rad, "Heading of the query in the place's frame.")
      .def_ro("lateral_m", &Candidate::lateral_m, "Of the query along the place's +y (left).")
      .def_prop_ro(
          "T_map_place", [](const Candidate& c) { return ArrayOf(c.T_map_place); },
          nb::rv_policy::move,
          "4x4 float64, metres: points in the place's sensor frame to the map frame.")
      .def_prop_ro(
          "T_map_query", [](const Candidate& c) { return ArrayOf(c.T_map_query); },
          nb::rv_policy::move,
          "4x4 float64, metres: points in the query's sensor frame to the map frame.")
      .def("__repr__", [](const Candidate& c) {
        return absl::StrCat("<Candidate place ", c.place, ", distance ", c.distance, ">");
      });

  nb::class_<Answer>(m, "Answer", "What is said to one query.")
      .def_ro("outcome", &Answer::outcome)
      .def_ro("reason", &Answer::reason, "Why this outcome, for a person.")
      .def_ro("candidates", &Answer::candidates, "Best first.")
      .def_ro("content_id", &Answer::content_id, "Of the map that gave the answer.")
      .def_prop_ro("localized", [](const Answer& a) { return a.outcome == Outcome::kLocalized; })
      .def_prop_ro(
          "T_map_query",
          [](const Answer& a) -> std::optional<Matrix> {
            if (a.outcome != Outcome::kLocalized) return std::nullopt;
            return ArrayOf(a.candidates.front().T_map_query);
          },
          nb::rv_policy::move,
          "Of the best candidate where the outcome is LOCALIZED, else None. 4x4 float64, metres.")
      .def("__repr__", [](const Answer& a) {
        return absl::StrCat("<Answer ", OutcomeName(a.outcome), ": ", a.reason, ">");
      });
}

}  // namespace scanloc::python
