#include "scanloc/eval/intensity_contexts.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace scanloc::eval {
namespace {

constexpr std::array<std::pair<IntensitySource, const char*>, 2> kSourceNames = {
    {{IntensitySource::kLidar, "intensity"}, {IntensitySource::kRadar, "radar"}}};

}  // namespace

IntensityContexts::IntensityContexts(DescriptorKind kind, bool augmented, IntensitySource source,
                                     const Params& params)
    : ContextBaseline(kind, augmented, kSourceNames[static_cast<std::size_t>(source)].second,
                      params),
      source_(source) {}

Eigen::VectorXf IntensityContexts::Encode(PointView points, std::span<const float> intensities,
                                          bool of_place) const {
  std::vector<double> shifts_m = Shifts_m();
  if (!of_place) shifts_m.resize(1);
  const auto num = static_cast<Eigen::Index>(num_cells());
  Eigen::VectorXf all(num * static_cast<Eigen::Index>(shifts_m.size()));
  for (std::size_t variant = 0; variant < shifts_m.size(); ++variant) {
    Eigen::VectorXf greatest = Eigen::VectorXf::Zero(num);
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(num);
    Eigen::VectorXd count = Eigen::VectorXd::Zero(num);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto bin = BinOf(points[i].x, points[i].y - shifts_m[variant]);
      if (!bin) continue;
      const auto at = static_cast<Eigen::Index>(*bin);
      greatest(at) = std::max(greatest(at), intensities[i]);
      sum(at) += intensities[i];
      count(at) += 1.0;
    }
    all.segment(static_cast<Eigen::Index>(variant) * num, num) =
        source_ == IntensitySource::kLidar
            ? greatest
            : Eigen::VectorXf((sum.array() / count.array().max(1.0)).cast<float>());
  }
  return all;
}

void IntensityContexts::Take(std::vector<Eigen::VectorXf> of_queries,
                             std::vector<Eigen::VectorXf> of_places) {
  of_queries_ = std::move(of_queries);
  of_places_ = std::move(of_places);
}

void IntensityContexts::Prepare(const Map& map, std::vector<Eigen::VectorXf> /*vectors*/) {
  float greatest = 0.0F;
  for (const Eigen::VectorXf& cells : of_places_) greatest = std::max(greatest, cells.maxCoeff());
  scale_ = greatest > 0.0F ? static_cast<float>(Context::kMaxHeight_cm) / greatest : 0.0F;
  std::vector<Eigen::VectorXf> scaled;
  scaled.reserve(of_places_.size());
  for (const Eigen::VectorXf& cells : of_places_) {
    scaled.emplace_back(
        cells.unaryExpr([this](float cell) { return static_cast<float>(CellOf(scale_ * cell)); }));
  }
  ContextBaseline::Prepare(map, std::move(scaled));
}

std::vector<std::uint16_t> IntensityContexts::CellsOf(const BaselineQuery& query) const {
  std::vector<std::uint16_t> cells;
  cells.reserve(num_cells());
  for (const float cell : of_queries_[query.number]) cells.push_back(CellOf(scale_ * cell));
  return cells;
}

std::unique_ptr<IntensityContexts> MakeIntensityContexts(const std::string& name,
                                                         const Params& params) {
  for (const auto& [source, text] : kSourceNames) {
    if (const auto method = ContextMethodOf(name, text)) {
      return std::make_unique<IntensityContexts>(method->kind, method->augmented, source, params);
    }
  }
  return nullptr;
}

}  // namespace scanloc::eval
