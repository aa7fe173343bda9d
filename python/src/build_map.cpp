#include "build_map.hpp"

#include <utility>

#include "absl/strings/str_cat.h"
#include "python_scans.hpp"
#include "scanloc/core/map/spacing.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/calibrate_map.hpp"
#include "scanloc/mapdb/check_session.hpp"
#include "scanloc/mapdb/fix_params.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

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

absl::Status CheckDrive(const mapdb::BuildOptions& options, const mapdb::SessionPlan& plan,
                        const mapdb::ScanLoader& load) {
  if (options.mode == mapdb::BuildMode::kResume) return absl::OkStatus();
  absl::Status status = mapdb::CheckPoses(options.params, plan, load);
  if (!status.ok() || options.mode == mapdb::BuildMode::kCreate) return status;
  return mapdb::CheckFrame(options.path, plan, load);
}

}  // namespace

PythonMap BuildMap(mapdb::BuildOptions options, GivenDrive drive, const BuildSteps& steps) {
  const std::vector<std::size_t> kept = SelectScans(drive, steps.spacing_m);
  const mapdb::SessionPlan plan = PlanOf(drive, kept);
  const mapdb::FixOptions fix{.resume = steps.resume,
                              .learn_scale = SetScale(steps.scale, options.params)};
  PythonScans scans(std::move(drive.scans));
  const auto load = [&](std::size_t i) {
    absl::StatusOr<PointCloud> scan = scans(kept[i]);
    if (scan.ok()) (void)ApplyMount(drive.mount, *scan);
    return scan;
  };
  const auto tell = [&](const mapdb::BuildProgress& now) {
    scans.Call([&] {
      if (!steps.progress.is_none()) steps.progress(now.num_done, now.num_scans);
    });
  };
  return UnlockedReading(scans, [&]() -> absl::StatusOr<PythonMap> {
    RETURN_IF_ERROR(mapdb::FixParams(fix, plan, load, options));
    if (steps.check) {
      RETURN_IF_ERROR(CheckDrive(options, plan, load));
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

absl::StatusOr<PythonMap> OpenMap(const std::string& path) {
  ASSIGN_OR_RETURN(Map map, mapdb::LoadMap(path));
  return PythonMap{std::make_shared<const Map>(std::move(map)), path};
}

}  // namespace scanloc::python
