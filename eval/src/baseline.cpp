#include "scanloc/eval/baseline.hpp"

#include "scanloc/eval/key_only.hpp"
#include "scanloc/eval/m2dp.hpp"
#include "scanloc/eval/several_trees.hpp"

namespace scanloc::eval {

Eigen::VectorXf Baseline::Describe(PointView /*scan*/) const { return {}; }

std::unique_ptr<Baseline> MakeBaseline(const std::string& name) {
  if (name == "m2dp") return std::make_unique<M2dp>();
  if (std::unique_ptr<Baseline> baseline = MakeKeyOnly(name)) return baseline;
  return MakeSeveralTrees(name);
}

std::string BaselineNames() {
  return "m2dp, pc-key, cc-key, a-pc-key, a-cc-key, a-pc-trees, a-cc-trees";
}

void AppendCandidate(const Map& map, std::size_t place, double distance, Answer* answer) {
  Candidate candidate;
  candidate.place = static_cast<std::int32_t>(place);
  candidate.distance = distance;
  candidate.T_map_place = map.places[place].T_map_place;
  candidate.T_map_query = candidate.T_map_place;
  answer->candidates.push_back(std::move(candidate));
}

}  // namespace scanloc::eval
