#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <filesystem>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "arrays.hpp"
#include "bindings.hpp"
#include "build_map.hpp"
#include "errors.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

constexpr char kBuildDoc[] =
    "scans: a sequence of N arrays (see Describer.describe), or a function of the scan's number "
    "that gives one; threads of scanloc call it one at a time, for some scans more than once. "
    "T_map_scan: N x 4 x 4 or N x 3 x 4, sensor to map frame [m]; with a mount, base to map frame. "
    "spacing_m: distance between places, so that places are fewer than scans; 0 makes every scan "
    "one. stamps_ns: N int. check: refuse poses that contradict the scans before anything is "
    "written. calibrate: find the map's look-alikes. num_threads 0: one a processor. progress: "
    "called with the number of scans done and of all. resume: go on with a build of the same "
    "arguments that was stopped, by Ctrl-C or in any other way; it keeps what it had written.";

// What build and append have alike, in signatures.
#define SCANLOC_DRIVE                                          \
  "scans: collections.abc.Sequence[numpy.typing.ArrayLike] | " \
  "collections.abc.Callable[[int], numpy.typing.ArrayLike], "  \
  "T_map_scan: numpy.typing.ArrayLike"
#define SCANLOC_EACH_SCAN                                    \
  "stamps_ns: collections.abc.Sequence[int] | None = None, " \
  "names: collections.abc.Sequence[str] | None = None"
#define SCANLOC_STEPS                                        \
  "mount: SensorMount = SensorMount(), check: bool = True, " \
  "calibrate: bool = True, resume: bool = False, "           \
  "num_threads: int = 0, "                                   \
  "progress: collections.abc.Callable[[int, int], object] | None = None"

/// Names of files may be no UTF-8; as os.fsdecode has them.
nb::str FsText(const std::string& text) {
  return nb::steal<nb::str>(
      PyUnicode_DecodeFSDefaultAndSize(text.data(), static_cast<Py_ssize_t>(text.size())));
}

}  // namespace

void BindMap(nb::module_& m) {
  nb::class_<PythonMap>(m, "Map", "A map file (*.scanloc) in memory; immutable.")
      .def_static(
          "open",
          [](const std::filesystem::path& path) { return Unlocked([&] { return OpenMap(path); }); },
          nb::arg("path"), "Reads the file and checks all of it. NotFound, DataLoss, ...")
      .def_static(
          "build",
          [](const std::filesystem::path& path, nb::object scans, nb::handle T_map_scan,
             double spacing_m, const std::optional<std::vector<std::int64_t>>& stamps_ns,
             const std::optional<std::vector<std::string>>& names, const std::string& session,
             const Params& params, std::optional<double> scale, const SensorMount& mount,
             bool check, bool calibrate, bool resume, int num_threads, nb::object progress) {
            return BuildMap({.path = path, .params = params, .num_threads = num_threads},
                            {session, std::move(scans), PosesOf(T_map_scan, "T_map_scan"),
                             stamps_ns, names, mount},
                            {spacing_m, scale, check, calibrate, resume, std::move(progress)});
          },
          nb::arg("path"), nb::arg("scans"), nb::arg("T_map_scan").none(), nb::kw_only(),
          nb::arg("spacing_m") = BuildSteps().spacing_m, nb::arg("stamps_ns") = nb::none(),
          nb::arg("names") = nb::none(), nb::arg("session") = "drive",
          nb::arg("params").sig("Params()") = Params{}, nb::arg("scale") = nb::none(),
          nb::arg("mount").sig("SensorMount()") = SensorMount{}, nb::arg("check") = true,
          nb::arg("calibrate") = true, nb::arg("resume") = false, nb::arg("num_threads") = 0,
          nb::arg("progress") = nb::none(),
          nb::sig("def build(path: str | os.PathLike, " SCANLOC_DRIVE
                  ", *, spacing_m: float = 1.0, " SCANLOC_EACH_SCAN
                  ", session: str = 'drive', params: Params = Params(), scale: float | None = "
                  "None, " SCANLOC_STEPS ") -> Map"),
          absl::StrCat("Writes a new map file and opens it. AlreadyExists if there is one. scale: "
                       "of the lengths by which auto sees a scene, 1 for streets and 0.35 for "
                       "rooms; None: learned from the scans, unless params set auto.*. ",
                       kBuildDoc)
              .c_str())
      .def_static(
          "append",
          [](const std::filesystem::path& path, nb::object scans, nb::handle T_map_scan,
             const std::string& session, double spacing_m,
             const std::optional<std::vector<std::int64_t>>& stamps_ns,
             const std::optional<std::vector<std::string>>& names, const SensorMount& mount,
             bool check, bool calibrate, bool resume, int num_threads, nb::object progress) {
            return BuildMap(
                {.path = path, .mode = mapdb::BuildMode::kAppend, .num_threads = num_threads},
                {session, std::move(scans), PosesOf(T_map_scan, "T_map_scan"), stamps_ns, names,
                 mount},
                {spacing_m, std::nullopt, check, calibrate, resume, std::move(progress)});
          },
          nb::arg("path"), nb::arg("scans"), nb::arg("T_map_scan").none(), nb::arg("session"),
          nb::kw_only(), nb::arg("spacing_m") = BuildSteps().spacing_m,
          nb::arg("stamps_ns") = nb::none(), nb::arg("names") = nb::none(),
          nb::arg("mount").sig("SensorMount()") = SensorMount{}, nb::arg("check") = true,
          nb::arg("calibrate") = true, nb::arg("resume") = false, nb::arg("num_threads") = 0,
          nb::arg("progress") = nb::none(),
          nb::sig("def append(path: str | os.PathLike, " SCANLOC_DRIVE
                  ", session: str, *, spacing_m: float = 1.0, " SCANLOC_EACH_SCAN ", " SCANLOC_STEPS
                  ") -> Map"),
          absl::StrCat("Adds a session to the file and opens it anew; maps opened before stay as "
                       "they were. ",
                       kBuildDoc)
              .c_str())
      .def_prop_ro("path", [](const PythonMap& map) { return FsText(map.path); })
      .def_prop_ro("params", [](const PythonMap& map) { return map.map->params; })
      .def_prop_ro("content_id", [](const PythonMap& map) { return map.map->content_id; })
      .def_prop_ro(
          "sessions", [](const PythonMap& map) { return map.map->sessions; }, "Names.")
      .def(
          "__len__", [](const PythonMap& map) { return map.map->places.size(); },
          "The number of places.")
      .def_prop_ro(
          "T_map_place",
          [](const PythonMap& map) {
            std::vector<double> values;
            values.reserve(16 * map.map->places.size());
            for (const Place& place : map.map->places) {
              const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = place.T_map_place.matrix();
              values.insert(values.end(), rows.data(), rows.data() + 16);
            }
            return ArrayOf(std::move(values), {map.map->places.size(), 4, 4});
          },
          nb::rv_policy::move, "Where the places are: N x 4 x 4 float64, sensor to map frame [m].")
      .def_prop_ro(
          "stamps_ns",
          [](const PythonMap& map) {
            std::vector<std::int64_t> values;
            for (const Place& place : map.map->places) values.push_back(place.stamp_ns);
            return ArrayOf(std::move(values), {map.map->places.size()});
          },
          nb::rv_policy::move, "When they were mapped: N int64; 0 where not known.")
      .def_prop_ro(
          "session_of_place",
          [](const PythonMap& map) {
            std::vector<std::int32_t> values;
            for (const Place& place : map.map->places) values.push_back(place.session);
            return ArrayOf(std::move(values), {map.map->places.size()});
          },
          nb::rv_policy::move, "N int32, indices into sessions.")
      .def("__repr__", [](const PythonMap& map) {
        return FsText(absl::StrCat("<Map ", map.path, ": ", map.map->places.size(), " places>"));
      });
}

}  // namespace scanloc::python
