#include "scanloc/eval/vector_baseline.hpp"

#include <algorithm>
#include <utility>

#include "shared.hpp"

namespace scanloc::eval {
namespace {

/// Of length one; zero stays zero. In double, where no square of a float overflows.
void Normalize(std::vector<Eigen::VectorXf>* vectors) {
  for (Eigen::VectorXf& vector : *vectors) {
    const Eigen::VectorXd wide = vector.cast<double>();
    if (wide.norm() > 0.0) vector = (wide / wide.norm()).cast<float>();
  }
}

}  // namespace

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

void VectorBaseline::Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) {
  map_ = &map;
  index_ = {};
  for (const Eigen::VectorXf& vector : vectors) index_.Add(vector);
}

Answer VectorBaseline::Recognize(const BaselineQuery& query) const {
  Answer answer;
  const Stopwatch description(query.now_ns);
  const Eigen::VectorXf vector = VectorOf(query);
  answer.times.describe_ns = description.Elapsed_ns();
  const Stopwatch retrieval(query.now_ns);
  for (const auto& [place, distance] : index_.Search(vector, query.num_answers, query.excluded)) {
    AppendCandidate(*map_, place, distance, &answer);
  }
  answer.times.retrieve_ns = retrieval.Elapsed_ns();
  return answer;
}

ComputedDescriptors::ComputedDescriptors(std::string name, VectorDistance distance,
                                         std::vector<Eigen::VectorXf> of_queries,
                                         std::vector<Eigen::VectorXf> of_places)
    : name_(std::move(name)),
      distance_(distance),
      of_queries_(std::move(of_queries)),
      of_places_(std::move(of_places)) {
  if (distance_ != VectorDistance::kCosine) return;
  Normalize(&of_queries_);
  Normalize(&of_places_);
}

void ComputedDescriptors::Prepare(const Map& map, std::vector<Eigen::VectorXf> /*vectors*/) {
  VectorBaseline::Prepare(map, of_places_);
}

Answer ComputedDescriptors::Recognize(const BaselineQuery& query) const {
  Answer answer = VectorBaseline::Recognize(query);
  if (distance_ == VectorDistance::kCosine) {
    // Between unit vectors.
    for (Candidate& candidate : answer.candidates) {
      candidate.distance = 0.5 * candidate.distance * candidate.distance;
    }
  }
  return answer;
}

}  // namespace scanloc::eval
