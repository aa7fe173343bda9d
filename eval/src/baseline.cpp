#include "scanloc/eval/baseline.hpp"

#include <algorithm>

#include "scanloc/eval/m2dp.hpp"

namespace scanloc::eval {

std::unique_ptr<Baseline> MakeBaseline(const std::string& name) {
  if (name == "m2dp") return std::make_unique<M2dp>();
  return nullptr;
}

std::string BaselineNames() { return "m2dp"; }

std::vector<BaselineIndex::Neighbor> BaselineIndex::Search(
    const Eigen::VectorXf& query, std::size_t k, const std::vector<bool>* excluded) const {
  std::vector<Neighbor> all;
  for (std::size_t i = 0; i < vectors_.size(); ++i) {
    if (excluded != nullptr && (*excluded)[i]) continue;
    all.push_back({i, static_cast<double>((vectors_[i] - query).norm())});
  }
  k = std::min(k, all.size());
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(k), all.end(),
                    [](const Neighbor& a, const Neighbor& b) {
                      return std::pair(a.distance, a.number) < std::pair(b.distance, b.number);
                    });
  all.resize(k);
  return all;
}

}  // namespace scanloc::eval
