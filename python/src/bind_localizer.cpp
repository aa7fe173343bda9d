#include <memory>
#include <mutex>

#include "arrays.hpp"
#include "bindings.hpp"
#include "python_map.hpp"
#include "query_options.hpp"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/scan/descriptor.hpp"

namespace nb = nanobind;

namespace scanloc::python {
namespace {

/// A describer is for one thread at a time.
struct SharedDescriber {
  explicit SharedDescriber(const Params& params) : describer(OrThrow(Describer::Create(params))) {}

  absl::StatusOr<ScanDescriptor> Describe(const Scan& scan) {
    const std::lock_guard<std::mutex> lock(mutex);
    return describer.Describe(scan.points());
  }

  std::mutex mutex;
  Describer describer;
};

struct PythonLocalizer {
  explicit PythonLocalizer(const PythonMap& map)
      : localizer(Unlocked([&] { return Localizer::Create(map.map); })),
        describer(map.map->params) {}

  std::shared_ptr<const Localizer> localizer;
  SharedDescriber describer;
};

nb::object ContextArray(const Context& context) {
  if (context.empty()) return nb::none();
  const auto rows = static_cast<std::size_t>(context.num_rows);
  const auto cols = static_cast<std::size_t>(context.num_cols);
  std::vector<std::uint16_t> cells(rows * cols);
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < cols; ++c) cells[r * cols + c] = context.cells_cm[c * rows + r];
  }
  return nb::cast(ArrayOf(std::move(cells), {rows, cols}));
}

nb::object PostArray(const ScanDescriptor& descriptor) {
  std::vector<float> posts_m;
  for (const Post& post : descriptor.structure.posts) {
    posts_m.push_back(static_cast<float>(post.x_cm) * 0.01F);
    posts_m.push_back(static_cast<float>(post.y_cm) * 0.01F);
  }
  const std::size_t num_posts = descriptor.structure.posts.size();
  return nb::cast(ArrayOf(std::move(posts_m), {num_posts, 2}));
}

}  // namespace

void BindLocalizer(nb::module_& m) {
  nb::class_<ScanDescriptor>(m, "ScanDescriptor", "What a query needs of one scan.")
      .def_ro("num_voxels", &ScanDescriptor::num_voxels, "Occupied voxels in range.")
      .def_prop_ro(
          "polar", [](const ScanDescriptor& d) { return ContextArray(d.polar); },
          "Polar context: rings x sectors, uint16, heights above ground [cm]; None if disabled.")
      .def_prop_ro(
          "cart", [](const ScanDescriptor& d) { return ContextArray(d.cart); },
          "Cart context: rows along x times columns along y, uint16 [cm]; None if disabled.")
      .def_prop_ro("posts", &PostArray,
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
          "are not finite are skipped. N x 3 in one piece is not copied.");

  nb::class_<PythonLocalizer>(m, "Localizer", "Answers queries against one map; thread-safe.")
      .def(nb::init<const PythonMap&>(), nb::arg("map"), "Builds the search trees.")
      .def(
          "localize",
          [](PythonLocalizer& self, nb::handle points, const std::optional<std::string>& method,
             std::optional<int> num_candidates, std::optional<double> threshold,
             std::optional<double> min_confidence, int max_answers) {
            const Query query =
                QueryOf(method, num_candidates, threshold, min_confidence, max_answers);
            if (nb::isinstance<ScanDescriptor>(points)) {
              const auto& descriptor = nb::cast<const ScanDescriptor&>(points);
              return Unlocked([&] { return self.localizer->Localize(descriptor, query); });
            }
            const Scan scan(points);
            return Unlocked([&]() -> absl::StatusOr<Answer> {
              const absl::StatusOr<ScanDescriptor> descriptor = self.describer.Describe(scan);
              if (!descriptor.ok()) return descriptor.status();
              return self.localizer->Localize(*descriptor, query);
            });
          },
          nb::arg("points").none(), SCANLOC_QUERY_ARGS,
          nb::sig("def localize(self, points: numpy.typing.ArrayLike | ScanDescriptor, *, method: "
                  "str | None = None, num_candidates: int | None = None, threshold: float | None = "
                  "None, min_confidence: float | None = None, max_answers: int = 1) -> Answer"),
          "Where a scan was taken. points: as for Describer.describe, or what that gave. What is "
          "None is as the map has it; method: 'auto', 'pc', 'cc', 'a-pc' or 'a-cc'.");
}

}  // namespace scanloc::python
