#include <nanobind/stl/optional.h>

#include <mutex>
#include <optional>
#include <vector>

#include "absl/strings/str_cat.h"
#include "arrays.hpp"
#include "bindings.hpp"
#include "errors.hpp"
#include "keywords.hpp"
#include "scanloc/core/loop_detector.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/messages.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

using Matrix6 = nb::ndarray<nb::numpy, double, nb::shape<6, 6>, nb::c_contig>;

/// A detector is for one thread at a time: they take turns.
class SharedLoopDetector {
 public:
  explicit SharedLoopDetector(const LoopDetectorOptions& options)
      : detector_(OrThrow(LoopDetector::Create(options))) {}

  template <typename Work>
  auto With(Work&& work) {
    return Unlocked([&] {
      const std::lock_guard<std::mutex> lock(mutex_);
      return work(detector_);
    });
  }

 private:
  std::mutex mutex_;
  LoopDetector detector_;
};

}  // namespace

void BindLoopDetector(nb::module_& m) {
  nb::class_<Loop>(m, "Loop", "A scan was taken where an earlier one was.")
      .def_ro("place", &Loop::place, "The earlier one, as add numbered it.")
      .def_prop_ro(
          "T_place_scan", [](const Loop& loop) { return ArrayOf(loop.T_place_scan); },
          nb::rv_policy::move,
          "4x4 float64, metres: points in the scan's sensor frame to the place's.")
      .def_prop_ro(
          "information",
          [](const Loop& loop) -> std::optional<Matrix6> {
            if (!loop.information) return std::nullopt;
            const Eigen::Matrix<double, 6, 6>& matrix = *loop.information;  // symmetric
            return ArrayOf<double, Matrix6>({matrix.data(), matrix.data() + 36}, {6, 6});
          },
          nb::rv_policy::move,
          "6x6 float64, of T_place_scan: x y z [1/m^2], roll pitch yaw [1/rad^2] along the axes of "
          "the place; None but with the method auto.")
      .def("__repr__",
           [](const Loop& loop) { return absl::StrCat("<Loop with place ", loop.place, ">"); });

  nb::class_<LoopAnswer>(m, "LoopAnswer", "What is said of a scan.")
      .def_prop_ro(
          "answer", [](const LoopAnswer& said) { return LocalizeReply{.answer = said.answer}; },
          "As a Localizer over the places outside the window.")
      .def_ro("loop", &LoopAnswer::loop, "None unless the answer is LOCALIZED.");

  nb::class_<SharedLoopDetector>(m, "LoopDetector",
                                 "Loop closure inside one's own SLAM: a map that grows as it is "
                                 "driven. Threads take turns.")
      .def(nb::new_([](const Params& params, double window_s, int window_places,
                       const nb::kwargs& options) {
             Keywords keywords(options);
             const Query query = TakeQuery(keywords);
             keywords.CheckAllTaken();
             return new SharedLoopDetector({.params = params,
                                            .query = query,
                                            .window_s = window_s,
                                            .window_places = window_places});
           }),
           nb::arg("params").sig("Params()") = Params{}, nb::arg("window_s") = 30.0,
           nb::arg("window_places") = 0, nb::arg("options"),
           "Places less than window_s before a scan, and the last window_places, are left out. "
           "options: method, num_candidates ... as for Localizer.localize.")
      .def(
          "add",
          [](SharedLoopDetector& self, nb::handle points, std::int64_t stamp_ns,
             nb::handle T_map_scan) {
            const Scan scan(points);
            const Pose pose = PoseOf(T_map_scan, "T_map_scan");
            return self.With([&](LoopDetector& detector) {
              return detector.Add(scan.points(), stamp_ns, pose);
            });
          },
          nb::arg("points").none(), nb::arg("stamp_ns"), nb::arg("T_map_scan").none(),
          nb::sig("def add(self, points: numpy.typing.ArrayLike, stamp_ns: int, T_map_scan: "
                  "numpy.typing.ArrayLike) -> int"),
          "Takes the next place and gives its number, from 0. points: as for Describer.describe. "
          "stamp_ns: not before the last. T_map_scan: 4x4, where the SLAM takes it to be [m].")
      .def(
          "query",
          [](SharedLoopDetector& self, nb::handle points, std::int64_t stamp_ns) {
            const Scan scan(points);
            return self.With(
                [&](LoopDetector& detector) { return detector.Query(scan.points(), stamp_ns); });
          },
          nb::arg("points").none(), nb::arg("stamp_ns"),
          nb::sig("def query(self, points: numpy.typing.ArrayLike, stamp_ns: int) -> LoopAnswer"),
          "Whether the scan was taken at an earlier place outside the window.")
      .def(
          "move_places",
          [](SharedLoopDetector& self, nb::handle T_map_place) {
            const std::vector<Pose> poses = PosesOf(T_map_place, "T_map_place");
            self.With([&](LoopDetector& detector) -> absl::StatusOr<bool> {
              RETURN_IF_ERROR(detector.MovePlaces(poses));
              return true;
            });
          },
          nb::arg("T_map_place").none(),
          nb::sig("def move_places(self, T_map_place: numpy.typing.ArrayLike) -> None"),
          "Where the SLAM takes all places to be after it has closed a loop: N x 4 x 4.")
      .def(
          "__len__",
          [](SharedLoopDetector& self) {
            return self.With([](LoopDetector& detector) -> absl::StatusOr<std::size_t> {
              return detector.num_places();
            });
          },
          "Places added.");
}

}  // namespace scanloc::python
