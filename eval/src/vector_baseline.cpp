#include "scanloc/eval/vector_baseline.hpp"

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
