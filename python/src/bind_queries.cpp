// What is said beside a scan: where it was taken, and how the sensor sits on the robot.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <tuple>
#include <utility>

#include "arrays.hpp"
#include "bindings.hpp"
#include "errors.hpp"
#include "scanloc/core/prior.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

using Corners = std::tuple<double, double, double, double, double, double>;
using Disc = std::tuple<double, double, double>;

SensorMount MountOf(const std::optional<nb::object>& T_base_sensor, double min_range_m,
                    const std::optional<Corners>& self_box) {
  SensorMount mount{.min_range_m = min_range_m};
  if (T_base_sensor) mount.T_base_sensor = PoseOf(*T_base_sensor, "T_base_sensor");
  if (self_box) {
    const auto& [x0, y0, z0, x1, y1, z1] = *self_box;
    mount.self_box = Box{.min_m = {x0, y0, z0}, .max_m = {x1, y1, z1}};
  }
  OrThrow(Validate(mount));
  return mount;
}

Prior PriorOf(const std::optional<Disc>& disc,
              const std::optional<std::pair<double, double>>& heights,
              const std::vector<std::string>& sessions, const std::optional<Disc>& on_earth) {
  Prior prior{.sessions = sessions};
  if (on_earth) {
    const auto& [latitude_deg, longitude_deg, radius_m] = *on_earth;
    prior.on_earth = {
        .latitude_deg = latitude_deg, .longitude_deg = longitude_deg, .radius_m = radius_m};
  }
  if (disc) {
    const auto& [x_m, y_m, radius_m] = *disc;
    prior.disc = {.x_m = x_m, .y_m = y_m, .radius_m = radius_m};
  }
  if (heights) prior.heights = {.min_m = heights->first, .max_m = heights->second};
  OrThrow(Validate(prior));
  return prior;
}

}  // namespace

void BindQueries(nb::module_& m) {
  nb::class_<SensorMount>(m, "SensorMount",
                          "How a sensor sits on a robot, and what of a scan is the robot itself. "
                          "Poses told are then those of the robot's base. Immutable.")
      .def(nb::new_(&MountOf), nb::kw_only(), nb::arg("T_base_sensor") = nb::none(),
           nb::arg("min_range_m") = 0.0, nb::arg("self_box") = nb::none(),
           "T_base_sensor: 4x4, the sensor's frame in the base's [m]. min_range_m: nearer points "
           "are not seen. self_box: x0 y0 z0 x1 y1 z1 in the base's frame [m], in which nothing is "
           "seen.")
      .def_prop_ro(
          "T_base_sensor", [](const SensorMount& mount) { return ArrayOf(mount.T_base_sensor); },
          nb::rv_policy::move);

  nb::class_<Prior>(m, "Prior",
                    "Where a scan was taken, as far as is known: places elsewhere, and rivals "
                    "there, are not looked at. Coordinates are those of the map [m]. Immutable.")
      .def(nb::new_(&PriorOf), nb::kw_only(), nb::arg("disc") = nb::none(),
           nb::arg("heights") = nb::none(), nb::arg("sessions") = std::vector<std::string>{},
           nb::arg("on_earth") = nb::none(),
           "disc: x, y, radius. heights: lowest and highest z of the sensor; one floor, say. "
           "sessions: names of the map's. on_earth: latitude, longitude [deg] and radius [m], in "
           "place of disc.");
}

}  // namespace scanloc::python
