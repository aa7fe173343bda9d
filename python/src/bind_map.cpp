#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "arrays.hpp"
#include "bindings.hpp"
#include "python_map.hpp"
#include "python_scans.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/mapdb/calibrate_map.hpp"
#include "scanloc/mapdb/check_session.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

absl::StatusOr<PythonMap> Open(const std::string& path) {
  absl::StatusOr<Map> map = mapdb::LoadMap(path);
  if (!map.ok()) return map.status();
  return PythonMap{std::make_shared<const Map>(*std::move(map)), path};
}

mapdb::SessionPlan PlanOf(const std::string& session, nb::handle T_map_scan,
                          const std::optional<std::vector<std::int64_t>>& stamps_ns,
                          const std::optional<std::vector<std::string>>& names,
                          const SensorMount& mount) {
  const std::vector<Pose> poses = PosesOf(T_map_scan, "T_map_scan");
  const auto check = [&](const char* name, std::size_t size) {
    if (size == poses.size()) return;
    throw StatusError(absl::InvalidArgumentError(
        absl::StrCat(name, " has ", size, " elements; T_map_scan has ", poses.size(), " poses")));
  };
  if (stamps_ns) check("stamps_ns", stamps_ns->size());
  if (names) check("names", names->size());
  mapdb::SessionPlan plan{.name = session};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    plan.scans.push_back({names ? (*names)[i] : absl::StrCat("scan-", i),
                          stamps_ns ? (*stamps_ns)[i] : 0,
                          TurnedOfSensor(mount, poses[i] * mount.T_base_sensor)});
  }
  return plan;
}

PythonMap Build(mapdb::BuildOptions options, nb::object given, const mapdb::SessionPlan& plan,
                const SensorMount& mount, bool check, bool calibrate) {
  if (nb::hasattr(given, "__len__") && nb::len(given) != plan.scans.size()) {
    throw StatusError(absl::InvalidArgumentError(absl::StrCat(
        "there are ", nb::len(given), " scans; T_map_scan has ", plan.scans.size(), " poses")));
  }
  PythonScans scans(std::move(given));
  const auto load = [&](std::size_t i) {
    absl::StatusOr<PointCloud> scan = scans(i);
    if (scan.ok()) (void)ApplyMount(mount, *scan);
    return scan;
  };
  return UnlockedReading(scans, [&]() -> absl::StatusOr<PythonMap> {
    if (options.mode == mapdb::BuildMode::kAppend) {
      const absl::StatusOr<mapdb::MapInfo> info = mapdb::ReadInfo(options.path);
      if (!info.ok()) return info.status();
      options.params = info->params;
    }
    if (check) {
      absl::Status status = mapdb::CheckPoses(options.params, plan, load);
      if (status.ok() && options.mode == mapdb::BuildMode::kAppend) {
        status = mapdb::CheckFrame(options.path, plan, load);
      }
      if (!status.ok()) return status;
    }
    if (absl::Status s = mapdb::BuildMap(options, plan, load).status(); !s.ok()) return s;
    if (calibrate && options.params.structure.enabled) {
      const mapdb::CalibrateOptions calibration{.path = options.path,
                                                .num_threads = options.num_threads};
      if (absl::Status s = mapdb::CalibrateMap(calibration).status(); !s.ok()) return s;
    }
    return Open(options.path);
  });
}

constexpr char kBuildDoc[] =
    "scans: a sequence of N arrays (see Describer.describe), or a function of the scan's number "
    "that gives one; threads of scanloc call it one at a time. T_map_scan: N x 4 x 4 or N x 3 x 4, "
    "sensor to map frame [m]; with a mount, base to map frame. stamps_ns: N int. check: refuse "
    "poses that contradict the scans "
    "before anything is written. calibrate: find the map's look-alikes. num_threads 0: one a "
    "processor.";

}  // namespace

void BindMap(nb::module_& m) {
  nb::class_<PythonMap>(m, "Map", "A map file (*.scanloc) in memory; immutable.")
      .def_static(
          "open", [](const std::string& path) { return Unlocked([&] { return Open(path); }); },
          nb::arg("path"), "Reads the file and checks all of it. NotFound, DataLoss, ...")
      .def_static(
          "build",
          [](const std::string& path, nb::object scans, nb::handle T_map_scan,
             const std::optional<std::vector<std::int64_t>>& stamps_ns,
             const std::optional<std::vector<std::string>>& names, const std::string& session,
             const Params& params, const SensorMount& mount, bool check, bool calibrate,
             int num_threads, bool resume) {
            const auto mode = resume ? mapdb::BuildMode::kResume : mapdb::BuildMode::kCreate;
            return Build({.path = path, .mode = mode, .params = params, .num_threads = num_threads},
                         std::move(scans), PlanOf(session, T_map_scan, stamps_ns, names, mount),
                         mount, check, calibrate);
          },
          nb::arg("path"), nb::arg("scans"), nb::arg("T_map_scan").none(), nb::kw_only(),
          nb::arg("stamps_ns") = nb::none(), nb::arg("names") = nb::none(),
          nb::arg("session") = "drive", nb::arg("params").sig("Params()") = Params{},
          nb::arg("mount").sig("SensorMount()") = SensorMount{}, nb::arg("check") = true,
          nb::arg("calibrate") = true, nb::arg("num_threads") = 0, nb::arg("resume") = false,
          absl::StrCat("Writes a new map file and opens it. AlreadyExists if there is one. resume: "
                       "goes on with a build of the same arguments that was killed. ",
                       kBuildDoc)
              .c_str())
      .def_static(
          "append",
          [](const std::string& path, nb::object scans, nb::handle T_map_scan,
             const std::string& session, const std::optional<std::vector<std::int64_t>>& stamps_ns,
             const std::optional<std::vector<std::string>>& names, const SensorMount& mount,
             bool check, bool calibrate, int num_threads) {
            return Build(
                {.path = path, .mode = mapdb::BuildMode::kAppend, .num_threads = num_threads},
                std::move(scans), PlanOf(session, T_map_scan, stamps_ns, names, mount), mount,
                check, calibrate);
          },
          nb::arg("path"), nb::arg("scans"), nb::arg("T_map_scan").none(), nb::arg("session"),
          nb::kw_only(), nb::arg("stamps_ns") = nb::none(), nb::arg("names") = nb::none(),
          nb::arg("mount").sig("SensorMount()") = SensorMount{}, nb::arg("check") = true,
          nb::arg("calibrate") = true, nb::arg("num_threads") = 0,
          absl::StrCat("Adds a session to the file and opens it anew; maps opened before stay as "
                       "they were. ",
                       kBuildDoc)
              .c_str())
      .def_ro("path", &PythonMap::path)
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
        return absl::StrCat("<Map ", map.path, ": ", map.map->places.size(), " places>");
      });
}

}  // namespace scanloc::python
