#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/scan_context/key_index.hpp"
#include "scanloc/eval/baseline.hpp"
#include "shared.hpp"

namespace scanloc::eval {
namespace {

/// The paper's methods without the check of the full descriptors (Sec. "Full descriptor's effect"):
/// places are ranked and matches accepted by the distance between retrieval keys alone [m].
class KeyOnly : public Baseline {
 public:
  KeyOnly(DescriptorKind kind, bool augmented) : kind_(kind), augmented_(augmented) {}

  [[nodiscard]] std::string name() const override {
    return MethodName({.kind = kind_, .augmented = augmented_}) + "-key";
  }
  [[nodiscard]] std::optional<DescriptorKind> context_kind() const override { return kind_; }
  void Prepare(const Map& map, std::vector<Eigen::VectorXf> /*vectors*/) override {
    map_ = &map;
    index_.emplace(TableOf(map, kind_));
  }
  [[nodiscard]] Answer Recognize(const BaselineQuery& query) const override {
    Answer answer;
    const Stopwatch retrieval(query.now_ns);
    const Keys keys = MakeKeys(ContextOf(query.descriptor, kind_));
    for (const KeyIndex::Neighbor& neighbor : index_->Search(
             keys.retrieval_cm, static_cast<int>(query.num_answers), augmented_, query.excluded)) {
      const auto place =
          static_cast<std::size_t>(TableOf(*map_, kind_).entry(neighbor.entry).place);
      AppendCandidate(*map_, place, neighbor.key_distance, &answer);
    }
    answer.times.retrieve_ns = retrieval.Elapsed_ns();
    return answer;
  }

 private:
  DescriptorKind kind_;
  bool augmented_;  // keys of root shifts and double flips, too
  const Map* map_ = nullptr;
  std::optional<KeyIndex> index_;
};

}  // namespace

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
