#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <map>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "arrays.hpp"
#include "bindings.hpp"
#include "scanloc/proto/messages.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

using Matrix6 = nb::ndarray<nb::numpy, double, nb::shape<6, 6>, nb::c_contig>;

}  // namespace

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
      .def_ro("map", &Candidate::map, "Name of its map where several were asked, else ''.")
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
          "4x4 float64, metres: points in the query's sensor frame to the map frame; with a mount, "
          "in that of the robot's base.")
      .def_prop_ro(
          "covariance",
          [](const Candidate& c) -> std::optional<Matrix6> {
            if (!c.covariance) return std::nullopt;
            const PoseCovariance& matrix = *c.covariance;  // symmetric
            return ArrayOf<double, Matrix6>({matrix.data(), matrix.data() + 36}, {6, 6});
          },
          nb::rv_policy::move,
          "6x6 float64, of T_map_query if it is right: x y z in the map [m^2], then the rotations "
          "about the map's axes, roll pitch yaw [rad^2]; None but with the method auto.")
      .def_prop_ro(
          "geo",
          [](const Candidate& c) -> std::optional<std::map<std::string, double>> {
            if (!c.geo) return std::nullopt;
            return std::map<std::string, double>{{"latitude", c.geo->latitude_deg},
                                                 {"longitude", c.geo->longitude_deg},
                                                 {"altitude_m", c.geo->altitude_m},
                                                 {"heading_deg", c.geo->heading_deg}};
          },
          "T_map_query on earth (WGS 84, above the ellipsoid; heading clockwise from true north); "
          "None where the map does not know where it stands.")
      .def("__repr__", [](const Candidate& c) {
        return absl::StrCat("<Candidate place ", c.place, ", distance ", c.distance, ">");
      });

  using Reply = LocalizeReply;
  nb::class_<Reply>(m, "Answer", "What is said to one query.")
      .def_prop_ro("outcome", [](const Reply& r) { return r.answer.outcome; })
      .def_prop_ro(
          "reason", [](const Reply& r) { return r.answer.reason; },
          "Why this outcome, for a person.")
      .def_prop_ro(
          "candidates", [](const Reply& r) { return r.answer.candidates; }, "Best first.")
      .def_prop_ro(
          "content_id", [](const Reply& r) { return r.answer.content_id; },
          "Of the map that gave the answer.")
      .def_ro("map", &Reply::map, "Name of the map that gave the answer.")
      .def_prop_ro(
          "stamp_ns", [](const Reply& r) { return r.header.stamp_ns; }, "As the query had it.")
      .def_prop_ro(
          "frame_id", [](const Reply& r) { return r.header.frame_id; }, "As the query had it.")
      .def_prop_ro("localized",
                   [](const Reply& r) { return r.answer.outcome == Outcome::kLocalized; })
      .def_prop_ro(
          "T_map_query",
          [](const Reply& r) -> std::optional<Matrix> {
            if (r.answer.outcome != Outcome::kLocalized) return std::nullopt;
            return ArrayOf(r.answer.candidates.front().T_map_query);
          },
          nb::rv_policy::move,
          "Of the best candidate where the outcome is LOCALIZED, else None. 4x4 float64, metres.")
      .def("__repr__", [](const Reply& r) {
        return absl::StrCat("<Answer ", OutcomeName(r.answer.outcome), ": ", r.answer.reason, ">");
      });
}

}  // namespace scanloc::python
