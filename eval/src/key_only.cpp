#include "scanloc/eval/key_only.hpp"

#include "scanloc/core/map/context_table.hpp"
#include "shared.hpp"

namespace scanloc::eval {

std::string KeyOnly::name() const {
  return MethodName({.kind = kind_, .augmented = augmented_}) + "-key";
}

void KeyOnly::Prepare(const Map& map, std::vector<Eigen::VectorXf> /*vectors*/) {
  map_ = &map;
  index_.emplace(TableOf(map, kind_));
}

Answer KeyOnly::Recognize(const BaselineQuery& query) const {
  Answer answer;
  const Stopwatch retrieval(query.now_ns);
  const Keys keys = MakeKeys(ContextOf(query.descriptor, kind_));
  for (const KeyIndex::Neighbor& neighbor : index_->Search(
           keys.retrieval_cm, static_cast<int>(query.num_answers), augmented_, query.excluded)) {
    const auto place = static_cast<std::size_t>(TableOf(*map_, kind_).entry(neighbor.entry).place);
    AppendCandidate(*map_, place, neighbor.key_distance, &answer);
  }
  answer.times.retrieve_ns = retrieval.Elapsed_ns();
  return answer;
}

std::unique_ptr<Baseline> MakeKeyOnly(const std::string& name) {
  for (const DescriptorKind kind : {DescriptorKind::kPolar, DescriptorKind::kCart}) {
    for (const bool augmented : {false, true}) {
      auto baseline = std::make_unique<KeyOnly>(kind, augmented);
      if (baseline->name() == name) return baseline;
    }
  }
  return nullptr;
}

}  // namespace scanloc::eval
