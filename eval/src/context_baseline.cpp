#include "scanloc/eval/context_baseline.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "scanloc/core/scan_context/match.hpp"
#include "shared.hpp"

namespace scanloc::eval {
namespace {

Context ContextFrom(const float* cells, int num_rows, int num_cols) {
  Context context{num_rows, num_cols, {}};
  context.cells_cm.assign(cells, cells + static_cast<std::ptrdiff_t>(num_rows) * num_cols);
  return context;
}

}  // namespace

std::optional<Method> ContextMethodOf(const std::string& name, const std::string& value) {
  const std::string end = "-" + value;
  if (!name.ends_with(end)) return std::nullopt;
  const absl::StatusOr<Method> method = ParseMethod(name.substr(0, name.size() - end.size()));
  const bool is_one =
      method.ok() && !method->automatic && !method->naive_alignment && !method->brute_force;
  return is_one ? std::optional(*method) : std::nullopt;
}

std::uint16_t CellOf(double value) {
  return static_cast<std::uint16_t>(
      std::lround(std::clamp(value, 0.0, static_cast<double>(Context::kMaxHeight_cm))));
}

ContextBaseline::ContextBaseline(DescriptorKind kind, bool augmented, std::string value,
                                 const Params& params)
    : kind_(kind),
      augmented_(augmented),
      name_(MethodName({.kind = kind, .augmented = augmented}) + "-" + std::move(value)),
      params_(params) {}

int ContextBaseline::num_rows() const {
  return kind_ == DescriptorKind::kPolar ? params_.polar.num_rings : params_.cart.num_rows;
}

int ContextBaseline::num_cols() const {
  return kind_ == DescriptorKind::kPolar ? params_.polar.num_sectors : params_.cart.num_cols;
}

std::size_t ContextBaseline::num_cells() const {
  return static_cast<std::size_t>(num_rows()) * static_cast<std::size_t>(num_cols());
}

std::vector<double> ContextBaseline::Shifts_m() const {
  std::vector<double> shifts_m = {0.0};
  if (augmented_ && kind_ == DescriptorKind::kPolar) {
    const std::vector<double>& more_m = params_.polar.root_shifts_m;
    shifts_m.insert(shifts_m.end(), more_m.begin(), more_m.end());
  }
  return shifts_m;
}

std::optional<std::size_t> ContextBaseline::BinOf(double x_m, double y_m) const {
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

void ContextBaseline::Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) {
  map_ = &map;
  table_ = ContextTable(num_rows(), num_cols());
  const std::vector<double> shifts_m = Shifts_m();
  for (std::size_t place = 0; place < vectors.size(); ++place) {
    for (std::size_t variant = 0; variant < shifts_m.size(); ++variant) {
      const Context context =
          ContextFrom(vectors[place].data() + variant * num_cells(), num_rows(), num_cols());
      const Keys keys = MakeKeys(context);
      table_.Append({.place = static_cast<std::int32_t>(place),
                     .root_shift_m = static_cast<float>(shifts_m[variant]),
                     .augmented = variant > 0},
                    context.cells_cm, keys.retrieval_cm, keys.aligning_cm);
      if (augmented_ && kind_ == DescriptorKind::kCart && params_.cart.double_flip) {
        table_.AppendFlipOfLast();
      }
    }
  }
  index_.emplace(table_);
}

Answer ContextBaseline::Recognize(const BaselineQuery& query) const {
  Answer answer;
  const Stopwatch description(query.now_ns);
  const Context context{num_rows(), num_cols(), CellsOf(query)};
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

}  // namespace scanloc::eval
