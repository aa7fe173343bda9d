#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "arrays.hpp"
#include "asking.hpp"
#include "bindings.hpp"
#include "errors.hpp"
#include "keywords.hpp"
#include "scanloc/client/client.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

std::chrono::milliseconds Milliseconds(double seconds, const char* name) {
  if (!(seconds >= 0.0 && seconds <= 3600.0)) {
    throw StatusError(absl::InvalidArgumentError(
        absl::StrCat(name, " is ", seconds, "; it must be in [0, 3600]")));
  }
  return std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1000.0 + 0.5));
}

/// gRPC has threads of its own, which a fork leaves behind: a child that used it would hang.
void CheckProcess() {
  static const pid_t first_process = getpid();
  if (getpid() == first_process) return;
  throw StatusError(absl::FailedPreconditionError(
      "this process was forked off one that has used scanloc.Client; connections do not survive "
      "that: start it by multiprocessing's 'spawn', or make the first Client after the fork"));
}

class PythonClient {
 public:
  explicit PythonClient(const client::ClientOptions& options) {
    CheckProcess();
    client_ = std::make_unique<client::Client>(
        Unlocked([&] { return client::Client::Connect(options); }));
  }
  ~PythonClient() {
    // Closing needs the threads, too: left open, the connection ends with the process.
    if (getpid() != process_) static_cast<void>(client_.release());
  }
  PythonClient(const PythonClient&) = delete;
  PythonClient& operator=(const PythonClient&) = delete;

  [[nodiscard]] const client::Client& get() const {
    CheckProcess();
    return *client_;
  }

 private:
  const pid_t process_ = getpid();
  std::unique_ptr<client::Client> client_;
};

}  // namespace

void BindClient(nb::module_& m) {
  nb::class_<MapSummary>(m, "MapSummary", "One line of the list of a server's maps.")
      .def_ro("name", &MapSummary::name)
      .def_prop_ro("serving", [](const MapSummary& map) { return map.state == MapState::kServing; })
      .def_ro("content_id", &MapSummary::content_id)
      .def_ro("num_places", &MapSummary::num_places);

  nb::class_<MapInfo>(m, "MapInfo", "What a server tells of one map.")
      .def_ro("name", &MapInfo::name)
      .def_ro("content_id", &MapInfo::content_id)
      .def_ro("params", &MapInfo::params)
      .def_ro("sessions", &MapInfo::sessions)
      .def_ro("num_places", &MapInfo::num_places);

  nb::class_<PythonClient>(m, "Client",
                           "Asks a scanlocd, as the C++ client does; thread-safe. Queries that "
                           "meet a server that is away or busy are repeated within the timeout.")
      .def(nb::new_([](const std::string& address, const std::string& token,
                       const std::string& tls_ca_file, const std::string& tls_cert_file,
                       const std::string& tls_key_file, const std::string& tls_server_name,
                       bool allow_plaintext_token, double timeout_s, double connect_timeout_s,
                       int max_attempts) {
             client::ClientOptions options{
                 .address = address,
                 .tls_ca_file = tls_ca_file,
                 .tls_cert_file = tls_cert_file,
                 .tls_key_file = tls_key_file,
                 .tls_server_name = tls_server_name,
                 .token = token,
                 .allow_plaintext_token = allow_plaintext_token,
                 .timeout = Milliseconds(timeout_s, "timeout_s"),
                 .connect_timeout = Milliseconds(connect_timeout_s, "connect_timeout_s")};
             options.retry.max_attempts = max_attempts;
             return new PythonClient(options);
           }),
           nb::arg("address"), nb::kw_only(), nb::arg("token") = "", nb::arg("tls_ca_file") = "",
           nb::arg("tls_cert_file") = "", nb::arg("tls_key_file") = "",
           nb::arg("tls_server_name") = "", nb::arg("allow_plaintext_token") = false,
           nb::arg("timeout_s") = 5.0, nb::arg("connect_timeout_s") = 5.0,
           nb::arg("max_attempts") = 4,
           "address: HOST:PORT. With tls_ca_file (PEM) the connection is encrypted. timeout_s: of "
           "a call, all its attempts included. connect_timeout_s 0: the first call connects.")
      .def(
          "localize",
          [](const PythonClient& self, nb::handle points, const std::string& map, bool send_scan,
             const nb::kwargs& options) {
            Keywords keywords(options);
            client::RequestOptions request = TakeRequest(keywords);
            keywords.CheckAllTaken();
            request.map = map;
            return Ask(self.get(), points, request, send_scan);
          },
          nb::arg("points").none(), nb::arg("map") = "", nb::arg("send_scan") = false,
          nb::arg("options"),
          nb::sig("def localize(self, points: numpy.typing.ArrayLike | ScanDescriptor, map: str = "
                  "'', send_scan: bool = False, *, " SCANLOC_REQUEST_KEYWORDS ") -> Answer"),
          "Where a scan was taken. points: as for Describer.describe, or what that gave. map: '' "
          "asks all that the server has, and the candidates say which. The scan is described here "
          "and some kilobytes are sent, or, with send_scan or several maps, 12 bytes a point; the "
          "answer is the same.")
      .def(
          "stream",
          [](const PythonClient& self, const std::string& map, const nb::kwargs& options) {
            Keywords keywords(options);
            client::StreamOptions stream = TakeStream(keywords);
            keywords.CheckAllTaken();
            stream.map = map;
            return OpenStream(self.get(), stream);
          },
          nb::arg("map") = "", nb::arg("options"),
          nb::sig("def stream(self, map: str = '', *, " SCANLOC_STREAM_KEYWORDS ") -> RobotStream"),
          "As Localizer.stream; map: '' stands for the only one.")
      .def("list_maps",
           [](const PythonClient& self) { return Unlocked([&] { return self.get().ListMaps(); }); })
      .def(
          "map_info",
          [](const PythonClient& self, const std::string& map) {
            return Unlocked([&] { return self.get().GetMapInfo(map); });
          },
          nb::arg("map") = "")
      .def(
          "is_serving",
          [](const PythonClient& self, const std::string& map) {
            return Unlocked([&] { return self.get().IsServing(map); });
          },
          nb::arg("map") = "", "Whether it answers for the map; '': for all that it has.");
}

}  // namespace scanloc::python
