#include "asking.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "arrays.hpp"
#include "bindings.hpp"
#include "errors.hpp"
#include "scanloc/core/status_macros.hpp"

namespace nb = nanobind;

namespace scanloc::python {

LocalizeReply Ask(const client::LocalizationClient& client, nb::handle points,
                  const client::RequestOptions& request, bool send_scan) {
  if (nb::isinstance<SignedDescriptor>(points)) {
    if (!(request.mount == SensorMount())) {
      throw StatusError(absl::InvalidArgumentError(
          "mount goes with a scan; descriptors are of the scan as it was described"));
    }
    const auto& descriptor = nb::cast<const SignedDescriptor&>(points);
    return Unlocked([&] { return client.LocalizeDescriptor(descriptor, request); });
  }
  const Scan scan(points);
  return Unlocked([&] {
    return send_scan ? client.LocalizeScan(scan.points(), request)
                     : client.LocalizeByDescriptor(scan.points(), request);
  });
}

class SharedStream {
 public:
  explicit SharedStream(client::RobotStream stream) : stream_(std::move(stream)) {}

  absl::StatusOr<TrackedReply> Locate(const Scan& scan, const std::optional<Pose>& T_last_scan,
                                      const ScanHeader& header) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return stream_.Locate(scan.points(), T_last_scan, header);
  }
  absl::StatusOr<bool> Close() {
    const std::lock_guard<std::mutex> lock(mutex_);
    RETURN_IF_ERROR(stream_.Close());
    return true;
  }

 private:
  std::mutex mutex_;
  client::RobotStream stream_;
};

nb::object OpenStream(const client::LocalizationClient& client,
                      const client::StreamOptions& options) {
  auto stream =
      std::make_unique<SharedStream>(Unlocked([&] { return client.OpenStream(options); }));
  return nb::cast(stream.release(), nb::rv_policy::take_ownership);
}

void BindStreams(nb::module_& m) {
  nb::class_<TrackedReply>(m, "TrackedAnswer",
                           "What is said of a scan in the light of those before it.")
      .def_ro("answer", &TrackedReply::reply)
      .def_ro("num_scans", &TrackedReply::num_scans, "That the best candidate rests on.")
      .def_ro("relocated", &TrackedReply::is_relocated,
              "The robot is localized, but not where it should have got to.");

  nb::class_<SharedStream>(m, "RobotStream",
                           "One robot that keeps moving: its scans are weighed together. From "
                           "Localizer.stream or Client.stream; ends with close or `with`.")
      .def(
          "locate",
          [](SharedStream& self, nb::handle points, nb::handle T_last_scan, std::int64_t stamp_ns,
             const std::string& frame_id) {
            const Scan scan(points);
            std::optional<Pose> moved;
            if (!T_last_scan.is_none()) moved = PoseOf(T_last_scan, "T_last_scan");
            const ScanHeader header{.stamp_ns = stamp_ns, .frame_id = frame_id};
            return Unlocked([&] { return self.Locate(scan, moved, header); });
          },
          nb::arg("points").none(), nb::arg("T_last_scan").none() = nb::none(),
          nb::arg("stamp_ns") = 0, nb::arg("frame_id") = "",
          nb::sig("def locate(self, points: numpy.typing.ArrayLike, T_last_scan: "
                  "numpy.typing.ArrayLike | None = None, stamp_ns: int = 0, frame_id: str = '') -> "
                  "TrackedAnswer"),
          "Where the robot is, by this scan and those before it. T_last_scan: 4x4 [m], this scan's "
          "pose in the sensor frame of the one before, by the robot's own reckoning; of the base, "
          "where there is a mount. After an error that is of this scan the stream goes on.")
      .def("close", [](SharedStream& self) { Unlocked([&] { return self.Close(); }); })
      .def(
          "__enter__", [](nb::object self) { return self; },
          nb::sig("def __enter__(self) -> RobotStream"))
      .def(
          "__exit__",
          [](SharedStream& self, nb::handle, nb::handle, nb::handle) {
            Unlocked([&] { return self.Close(); });
          },
          nb::arg("type").none(), nb::arg("value").none(), nb::arg("traceback").none());
}

}  // namespace scanloc::python
