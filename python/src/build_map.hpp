#pragma once

#include <nanobind/nanobind.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "python_map.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/mapdb/build_map.hpp"

namespace scanloc::python {

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

/// Builds with options.mode kCreate or kAppend; opens the map. What fails is thrown.
[[nodiscard]] PythonMap BuildMap(mapdb::BuildOptions options, GivenDrive drive,
                                 const BuildSteps& steps);

/// Reads the file and checks all of it.
[[nodiscard]] absl::StatusOr<PythonMap> OpenMap(const std::string& path);

}  // namespace scanloc::python
