#include "scanloc/eval/bin_encoding.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "scanloc/core/scan/voxel_filter.hpp"
#include "scanloc/core/scan_context/match.hpp"
#include "shared.hpp"

namespace scanloc::eval {
namespace {

constexpr std::array<std::pair<BinValue, const char*>, 3> kValueNames = {
    {{BinValue::kMean, "mean"}, {BinValue::kCount, "count"}, {BinValue::kBits, "bits"}}};
constexpr int kNumBits = 8;

/// What is gathered of the voxels in a bin.
struct Bin {
  double sum_cm = 0.0;
  int count = 0;
  unsigned bits = 0;

  void Add(double height_m) {
    sum_cm += 100.0 * height_m;
    ++count;
    bits |= 1U << static_cast<unsigned>(std::clamp(height_m, 0.0, kNumBits - 1.0));
  }

  [[nodiscard]] std::uint16_t Value(BinValue value) const {
    if (count == 0) return 0;
    double number = 0.0;
    if (value == BinValue::kMean) number = sum_cm / count;
    if (value == BinValue::kCount) number = count;
    if (value == BinValue::kBits) number = bits;
    const double highest = Context::kMaxHeight_cm;
    return static_cast<std::uint16_t>(std::lround(std::clamp(number, 0.0, highest)));
  }
};

Context ContextFrom(const float* cells, int num_rows, int num_cols) {
  Context context{num_rows, num_cols, {}};
  context.cells_cm.assign(cells, cells + static_cast<std::ptrdiff_t>(num_rows) * num_cols);
  return context;
}

}  // namespace

std::string BinEncoding::name() const {
  const std::string method = MethodName({.kind = kind_, .augmented = augmented_});
  for (const auto& [value, name] : kValueNames) {
    if (value == value_) return method + "-" + name;
  }
  return method;
}

int BinEncoding::num_rows() const {
  return kind_ == DescriptorKind::kPolar ? params_.polar.num_rings : params_.cart.num_rows;
}

int BinEncoding::num_cols() const {
  return kind_ == DescriptorKind::kPolar ? params_.polar.num_sectors : params_.cart.num_cols;
}

bool BinEncoding::has_flips() const {
  return augmented_ && kind_ == DescriptorKind::kCart && params_.cart.double_flip;
}

std::optional<std::size_t> BinEncoding::BinOf(double x_m, double y_m) const {
  double row = 0.0, col = 0.0;
  if (kind_ == DescriptorKind::kPolar) {
    const double turn = std::atan2(y_m, x_m) / (2.0 * std::numbers::pi);
    row = std::hypot(x_m, y_m) / params_.polar.max_range_m * num_rows();
    col = std::min((turn < 0.0 ? turn + 1.0 : turn) * num_cols(), num_cols() - 0.5);
  } else {
    row = (x_m / params_.cart.max_x_m + 1.0) / 2.0 * num_rows();
    col = (y_m / params_.cart.max_y_m + 1.0) / 2.0 * num_cols();
  }
  if (!(row >= 0.0 && row < num_rows() && col >= 0.0 && col < num_cols())) return std::nullopt;
  return static_cast<std::size_t>(col) * static_cast<std::size_t>(num_rows()) +
         static_cast<std::size_t>(row);
}

std::vector<std::uint16_t> BinEncoding::Encode(const PointCloud& voxels, double shift_m) const {
  std::vector<Bin> bins(static_cast<std::size_t>(num_rows()) *
                        static_cast<std::size_t>(num_cols()));
  for (const Point& p : voxels) {
    if (const std::optional<std::size_t> bin = BinOf(p.x, p.y - shift_m)) {
      bins[*bin].Add(p.z + params_.sensor_height_m);
    }
  }
  std::vector<std::uint16_t> cells;
  cells.reserve(bins.size());
  for (const Bin& bin : bins) cells.push_back(bin.Value(value_));
  return cells;
}

Eigen::VectorXf BinEncoding::Describe(PointView scan) const {
  VoxelFilter filter(params_.voxel_size_m);
  const PointCloud& voxels = filter.Apply(scan);
  std::vector<double> shifts_m = {0.0};
  if (augmented_ && kind_ == DescriptorKind::kPolar) {
    const std::vector<double>& more_m = params_.polar.root_shifts_m;
    shifts_m.insert(shifts_m.end(), more_m.begin(), more_m.end());
  }
  std::vector<float> all;
  for (const double shift_m : shifts_m) {
    const std::vector<std::uint16_t> cells = Encode(voxels, shift_m);
    all.insert(all.end(), cells.begin(), cells.end());
  }
  return Eigen::Map<const Eigen::VectorXf>(all.data(), static_cast<Eigen::Index>(all.size()));
}

void BinEncoding::Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) {
  map_ = &map;
  table_ = ContextTable(num_rows(), num_cols());
  const Eigen::Index num_cells = Eigen::Index{num_rows()} * num_cols();
  for (std::size_t place = 0; place < vectors.size(); ++place) {
    for (Eigen::Index variant = 0; variant * num_cells < vectors[place].size(); ++variant) {
      const Context context =
          ContextFrom(vectors[place].data() + variant * num_cells, num_rows(), num_cols());
      const Keys keys = MakeKeys(context);
      const bool is_shifted = variant > 0;
      const auto shift = static_cast<std::size_t>(variant - 1);
      const double shift_m = is_shifted ? params_.polar.root_shifts_m[shift] : 0.0;
      table_.Append({.place = static_cast<std::int32_t>(place),
                     .root_shift_m = static_cast<float>(shift_m),
                     .augmented = is_shifted},
                    context.cells_cm, keys.retrieval_cm, keys.aligning_cm);
      if (has_flips()) table_.AppendFlipOfLast();
    }
  }
  index_.emplace(table_);
}

Answer BinEncoding::Recognize(const BaselineQuery& query) const {
  Answer answer;
  const Stopwatch description(query.now_ns);
  VoxelFilter filter(params_.voxel_size_m);
  const Context context{num_rows(), num_cols(), Encode(filter.Apply(query.scan), 0.0)};
  const Keys keys = MakeKeys(context);
  answer.times.describe_ns = description.Elapsed_ns();

  const Stopwatch retrieval(query.now_ns);
  const int k = query.num_candidates.value_or(params_.search.num_candidates);
  const std::vector<KeyIndex::Neighbor> nearest =
      index_->Search(keys.retrieval_cm, k, augmented_, query.excluded);
  answer.times.retrieve_ns = retrieval.Elapsed_ns();

  const Stopwatch matching(query.now_ns);
  const ContextView view{context.num_rows, context.num_cols, context.cells_cm, keys.aligning_cm};
  const AlignOptions align = AlignOptionsOf(params_, kind_);
  std::map<std::int32_t, double> distances;
  for (const KeyIndex::Neighbor& neighbor : nearest) {
    distances[table_.entry(neighbor.entry).place] =
        AlignByKey(view, table_.context(neighbor.entry), align).distance;
  }
  AppendNearest(*map_, distances, query.num_answers, &answer);
  answer.times.match_ns = matching.Elapsed_ns();
  return answer;
}

std::unique_ptr<Baseline> MakeBinEncoding(const std::string& name, const Params& params) {
  for (const DescriptorKind kind : {DescriptorKind::kPolar, DescriptorKind::kCart}) {
    for (const bool augmented : {false, true}) {
      for (const auto& [value, text] : kValueNames) {
        auto baseline = std::make_unique<BinEncoding>(kind, augmented, value, params);
        if (baseline->name() == name) return baseline;
      }
    }
  }
  return nullptr;
}

}  // namespace scanloc::eval
