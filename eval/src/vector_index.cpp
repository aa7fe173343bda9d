#include "scanloc/eval/vector_index.hpp"

#include <algorithm>
#include <utility>

namespace scanloc::eval {

std::vector<VectorIndex::Neighbor> VectorIndex::Search(const Eigen::VectorXf& query, std::size_t k,
                                                       const std::vector<bool>* excluded) const {
  std::vector<Neighbor> all;
  if (query.isZero(0.0F)) return all;
  for (std::size_t i = 0; i < vectors_.size(); ++i) {
    if (excluded != nullptr && (*excluded)[i]) continue;
    if (vectors_[i].isZero(0.0F)) continue;
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
