#include <nanobind/nanobind.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "arrays.hpp"
#include "bindings.hpp"
#include "errors.hpp"
#include "python_map.hpp"
#include "python_scans.hpp"
#include "scanloc/core/map/spacing.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/calibrate_map.hpp"
#include "scanloc/mapdb/check_session.hpp"
#include "scanloc/mapdb/fix_params.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

/// A drive as Python gives it; stamps and names of all scans or of none.
struct GivenDrive {
  std::string session;
  nanobind::object scans;
  std::vector<Pose> T_map_scan;  ///< of the base, with a mount
  std::optional<std::vector<std::int64_t>> stamps_ns;
  std::optional<std::vector<std::string>> names;
  SensorMount mount;
};

/// How it becomes places.
struct BuildSteps {
  double spacing_m = 1.0;
  std::optional<double> scale;  ///< of a new map
  bool check = true;
  bool calibrate = true;
  bool resume = false;
  nanobind::object progress;  ///< None, or called with the number of scans done and of all
};

/// The scans that become places, by their numbers in the drive.
std::vector<std::size_t> SelectScans(const GivenDrive& drive, double spacing_m) {
  const auto check = [&](const char* name, std::size_t size) {
    if (size == drive.T_map_scan.size()) return;
    throw StatusError(absl::InvalidArgumentError(absl::StrCat(
        name, " has ", size, " elements; T_map_scan has ", drive.T_map_scan.size(), " poses")));
  };
  if (nb::hasattr(drive.scans, "__len__")) check("scans", nb::len(drive.scans));
  if (drive.stamps_ns) check("stamps_ns", drive.stamps_ns->size());
  if (drive.names) check("names", drive.names->size());
  if (!(spacing_m >= 0.0 && spacing_m <= 1e6)) {
    throw StatusError(absl::InvalidArgumentError(absl::StrCat(
        "spacing_m is ", spacing_m, "; it must be in [0, 1e6] m, and 0 keeps every scan")));
  }
  return SelectBySpacing(drive.T_map_scan, spacing_m);
}

mapdb::SessionPlan PlanOf(const GivenDrive& drive, const std::vector<std::size_t>& kept) {
  mapdb::SessionPlan plan{.name = drive.session};
  for (const std::size_t i : kept) {
    plan.scans.push_back(
        {drive.names ? (*drive.names)[i] : absl::StrCat("scan-", i),
         drive.stamps_ns ? (*drive.stamps_ns)[i] : 0,
         TurnedOfSensor(drive.mount, drive.T_map_scan[i] * drive.mount.T_base_sensor)});
  }
  return plan;
}

/// Whether the scale is to be learned.
bool SetScale(const std::optional<double>& scale, Params& params) {
  const bool is_set = params.automatic != AutoParams();
  if (!scale) return !is_set;
  if (is_set) {
    throw StatusError(
        absl::InvalidArgumentError("params set auto.* and scale is given; give one of the two"));
  }
  if (!(*scale >= kMinScale && *scale <= kMaxScale)) {
    throw StatusError(absl::InvalidArgumentError(
        absl::StrCat("scale is ", *scale, "; it must be in [", kMinScale, ", ", kMaxScale,
                     "], for example 0.35 for rooms, or None to learn it from the scans")));
  }
  params.automatic = AutoParamsAtScale(*scale);
  return false;
}

/// `whole` is the drive with all its scans, by load_any; the plan has those that become places.
absl::Status CheckDrive(const mapdb::BuildOptions& options, const mapdb::SessionPlan& whole,
                        double spacing_m, const mapdb::ScanLoader& load_any,
                        const mapdb::SessionPlan& plan, const mapdb::ScanLoader& load) {
  if (options.mode == mapdb::BuildMode::kResume) return absl::OkStatus();
  absl::Status status = mapdb::CheckPoses(options.params, whole, spacing_m, load_any);
  if (!status.ok() || options.mode == mapdb::BuildMode::kCreate) return status;
  return mapdb::CheckFrame(options.path, plan, load);
}

/// Reads the file and checks all of it.
absl::StatusOr<PythonMap> OpenMap(const std::string& path) {
  ASSIGN_OR_RETURN(Map map, mapdb::LoadMap(path));
  return PythonMap{std::make_shared<const Map>(std::move(map)), path};
}

/// Builds with options.mode kCreate or kAppend; opens the map. What fails is thrown.
PythonMap BuildMap(mapdb::BuildOptions options, GivenDrive drive, const BuildSteps& steps) {
  const std::vector<std::size_t> kept = SelectScans(drive, steps.spacing_m);
  const mapdb::SessionPlan plan = PlanOf(drive, kept);
  const mapdb::SessionPlan whole = PlanOf(drive, SelectScans(drive, 0.0));
  const mapdb::FixOptions fix{.resume = steps.resume,
                              .learn_scale = SetScale(steps.scale, options.params)};
  PythonScans scans(std::move(drive.scans));
  const auto load_any = [&](std::size_t i) {
    absl::StatusOr<PointCloud> scan = scans(i);
    if (scan.ok()) (void)ApplyMount(drive.mount, *scan);
    return scan;
  };
  const auto load = [&](std::size_t i) { return load_any(kept[i]); };
  const auto tell = [&](const mapdb::BuildProgress& now) {
    scans.Call([&] {
      if (!steps.progress.is_none()) steps.progress(now.num_done, now.num_scans);
    });
  };
  return UnlockedReading(scans, [&]() -> absl::StatusOr<PythonMap> {
    RETURN_IF_ERROR(mapdb::FixParams(fix, plan, load, options));
    if (steps.check) {
      RETURN_IF_ERROR(CheckDrive(options, whole, steps.spacing_m, load_any, plan, load));
    }
    RETURN_IF_ERROR(mapdb::BuildMap(options, plan, load, tell).status());
    if (steps.calibrate && options.params.structure.enabled) {
      const mapdb::CalibrateOptions calibration{
          .path = options.path,
          .num_threads = options.num_threads,
          .progress = [&](const mapdb::CalibrateProgress&) { scans.Call([] {}); },
          .is_cancelled = [&] { return scans.raised(); }};
      RETURN_IF_ERROR(mapdb::CalibrateMap(calibration).status());
    }
    return OpenMap(options.path);
  });
}

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
