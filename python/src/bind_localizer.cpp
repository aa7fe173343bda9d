#include <memory>
#include <mutex>
#include <optional>

#include "arrays.hpp"
#include "asking.hpp"
#include "bindings.hpp"
#include "errors.hpp"
#include "keywords.hpp"
#include "python_map.hpp"
#include "scanloc/client/offline_client.hpp"
#include "scanloc/core/scan/descriptor.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

/// A describer is for one thread at a time.
struct SharedDescriber {
  explicit SharedDescriber(const Params& params)
      : signature(DescriptorSignature(params)), describer(OrThrow(Describer::Create(params))) {}

  absl::StatusOr<SignedDescriptor> Describe(const Scan& scan) {
    const std::lock_guard<std::mutex> lock(mutex);
    return SignedDescriptor{signature, describer.DescribeRows(scan.rows())};
  }

  const std::string signature;
  std::mutex mutex;
  Describer describer;
};

struct PythonLocalizer {
  explicit PythonLocalizer(const PythonMap& map)
      : client(Unlocked([&] { return client::OfflineClient::Create(map.map); })) {}

  std::shared_ptr<const client::OfflineClient> client;
};

template <typename T>
using Array = nb::ndarray<nb::numpy, T, nb::c_contig>;

std::optional<Array<std::uint16_t>> ContextArray(const Context& context) {
  if (context.empty()) return std::nullopt;
  const auto rows = static_cast<std::size_t>(context.num_rows);
  const auto cols = static_cast<std::size_t>(context.num_cols);
  std::vector<std::uint16_t> cells(rows * cols);
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < cols; ++c) cells[r * cols + c] = context.cells_cm[c * rows + r];
  }
  return ArrayOf(std::move(cells), {rows, cols});
}

Array<float> PostArray(const SignedDescriptor& of) {
  const std::vector<Post>& posts = of.descriptor.structure.posts;
  std::vector<float> posts_m;
  for (const Post& post : posts) {
    posts_m.push_back(static_cast<float>(post.x_cm) * 0.01F);
    posts_m.push_back(static_cast<float>(post.y_cm) * 0.01F);
  }
  return ArrayOf(std::move(posts_m), {posts.size(), 2});
}

}  // namespace

void BindLocalizer(nb::module_& m) {
  nb::class_<SignedDescriptor>(m, "ScanDescriptor",
                               "What a query needs of one scan; for maps of the same parameters.")
      .def_prop_ro(
          "num_voxels", [](const SignedDescriptor& d) { return d.descriptor.num_voxels; },
          "Occupied voxels in range.")
      .def_prop_ro(
          "polar", [](const SignedDescriptor& d) { return ContextArray(d.descriptor.polar); },
          nb::rv_policy::move,
          "Polar context: rings x sectors, uint16, heights above ground [cm]; None if disabled.")
      .def_prop_ro(
          "cart", [](const SignedDescriptor& d) { return ContextArray(d.descriptor.cart); },
          nb::rv_policy::move,
          "Cart context: rows along x times columns along y, uint16 [cm]; None if disabled.")
      .def_prop_ro("posts", &PostArray, nb::rv_policy::move,
                   "Upright things seen from above: N x 2 float32, x y in the levelled frame [m].");

  nb::class_<SharedDescriber>(m, "Describer",
                              "Makes descriptors of scans. Threads take turns; for speed, one "
                              "for each.")
      .def(nb::init<const Params&>(), nb::arg("params").sig("Params()") = Params{})
      .def(
          "describe",
          [](SharedDescriber& self, nb::handle points) {
            const Scan scan(points);
            return Unlocked([&] { return self.Describe(scan); });
          },
          nb::arg("points").none(),
          nb::sig("def describe(self, points: numpy.typing.ArrayLike) -> ScanDescriptor"),
          "points: N x 3 or N x 4 float32, sensor frame, x forward, y left, z up [m]. Points that "
          "are not finite are skipped. Rows in one piece, however far apart, are not copied.");

  nb::class_<PythonLocalizer>(m, "Localizer", "Answers queries against one map; thread-safe.")
      .def(nb::init<const PythonMap&>(), nb::arg("map"), "Builds the search trees.")
      .def(
          "localize",
          [](const PythonLocalizer& self, nb::handle points, const nb::kwargs& options) {
            Keywords keywords(options);
            const client::RequestOptions request = TakeRequest(keywords);
            keywords.CheckAllTaken();
            return Ask(*self.client, points, request);
          },
          nb::arg("points").none(), nb::arg("options"),
          nb::sig("def localize(self, points: numpy.typing.ArrayLike | ScanDescriptor, "
                  "*, " SCANLOC_REQUEST_KEYWORDS ") -> Answer"),
          "Where a scan was taken. points: as for Describer.describe, or what that gave. What is "
          "None is as the map has it; method: 'auto', 'pc', 'cc', 'a-pc' or 'a-cc'. stamp_ns and "
          "frame_id come back with the answer.")
      .def(
          "stream",
          [](const PythonLocalizer& self, const nb::kwargs& options) {
            Keywords keywords(options);
            const client::StreamOptions stream = TakeStream(keywords);
            keywords.CheckAllTaken();
            return OpenStream(*self.client, stream);
          },
          nb::arg("options"),
          nb::sig("def stream(self, *, " SCANLOC_STREAM_KEYWORDS ") -> RobotStream"),
          "For one robot that keeps moving. max_step_m: without odometry, farthest it goes between "
          "two scans.");
}

}  // namespace scanloc::python
