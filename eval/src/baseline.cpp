#include "scanloc/eval/baseline.hpp"

#include <algorithm>
#include <utility>

#include "scanloc/eval/m2dp.hpp"
#include "scanloc/eval/seg_match.hpp"
#include "shared.hpp"

namespace scanloc::eval {

Eigen::VectorXf Baseline::Describe(PointView /*scan*/) const { return {}; }

std::unique_ptr<Baseline> MakeBaseline(const std::string& name, const Params& params) {
  if (name == "m2dp") return std::make_unique<M2dp>();
  if (name == "segmatch") return std::make_unique<SegMatch>();
  if (std::unique_ptr<Baseline> baseline = MakeBinEncoding(name, params)) return baseline;
  if (std::unique_ptr<Baseline> baseline = MakeKeyOnly(name)) return baseline;
  return MakeSeveralTrees(name);
}

std::string BaselineNames() {
  return "m2dp, segmatch, pc-key, cc-key, a-pc-key, a-cc-key, a-pc-trees, a-cc-trees, and pc, cc, "
         "a-pc and a-cc each with -mean, -count, -bits, -intensity or -radar";
}

void AppendCandidate(const Map& map, std::size_t place, double distance, Answer* answer) {
  Candidate candidate;
  candidate.place = static_cast<std::int32_t>(place);
  candidate.distance = distance;
  candidate.T_map_place = map.places[place].T_map_place;
  candidate.T_map_query = candidate.T_map_place;
  answer->candidates.push_back(std::move(candidate));
}

void AppendNearest(const Map& map, const std::map<std::int32_t, double>& distances, std::size_t num,
                   Answer* answer) {
  std::vector<std::pair<double, std::int32_t>> ranked;
  ranked.reserve(distances.size());
  for (const auto& [place, distance] : distances) ranked.emplace_back(distance, place);
  std::ranges::sort(ranked);
  ranked.resize(std::min(ranked.size(), num));
  for (const auto& [distance, place] : ranked) {
    AppendCandidate(map, static_cast<std::size_t>(place), distance, answer);
  }
}

}  // namespace scanloc::eval
