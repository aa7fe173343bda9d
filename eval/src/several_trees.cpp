#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/scan_context/key_index.hpp"
#include "scanloc/core/scan_context/match.hpp"
#include "scanloc/eval/baseline.hpp"
#include "shared.hpp"

namespace scanloc::eval {
namespace {

/// The augmented methods with a k-d tree of its own for each variant, instead of one that holds the
/// original and the augmented keys (paper, Sec. V-D): the k nearest places of every tree are
/// compared by full descriptor, after pre-alignment, and the best is taken.
class SeveralTrees : public Baseline {
 public:
  explicit SeveralTrees(DescriptorKind kind) : kind_(kind) {}

  [[nodiscard]] std::string name() const override {
    return MethodName({.kind = kind_, .augmented = true}) + "-trees";
  }
  [[nodiscard]] std::optional<DescriptorKind> context_kind() const override { return kind_; }
  [[nodiscard]] bool takes_candidates() const override { return true; }
  void Prepare(const Map& map, std::vector<Eigen::VectorXf> /*vectors*/) override {
    map_ = &map;
    const ContextTable& all = TableOf(map, kind_);
    trees_.clear();
    std::size_t variant = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      // The entries of a place follow each other, the variants always in the same order.
      const bool is_same_place = i > 0 && all.entry(i).place == all.entry(i - 1).place;
      variant = is_same_place ? variant + 1 : 0;
      if (variant == trees_.size()) {
        trees_.push_back({.table = ContextTable(all.num_rows(), all.num_cols()), .index = {}});
      }
      // Each tree holds what it has for the places as they are.
      ContextTable::Entry entry = all.entry(i);
      entry.augmented = false;
      const ContextView context = all.context(i);
      trees_[variant].table.Append(entry, context.cells_cm, all.retrieval_key_cm(i),
                                   context.aligning_cm);
    }
    for (Tree& tree : trees_) tree.index.emplace(tree.table);
  }
  [[nodiscard]] Answer Recognize(const BaselineQuery& query) const override {
    Answer answer;
    const Context& context = ContextOf(query.descriptor, kind_);
    const Keys keys = MakeKeys(context);
    const ContextView view{context.num_rows, context.num_cols, context.cells_cm, keys.aligning_cm};
    const int k = query.num_candidates.value_or(map_->params.search.num_candidates);

    const Stopwatch retrieval(query.now_ns);
    std::vector<std::pair<const Tree*, std::size_t>> retrieved;  // tree and entry
    for (const Tree& tree : trees_) {
      for (const auto& neighbor : tree.index->Search(keys.retrieval_cm, k, false, query.excluded)) {
        retrieved.emplace_back(&tree, neighbor.entry);
      }
    }
    answer.times.retrieve_ns = retrieval.Elapsed_ns();

    const Stopwatch matching(query.now_ns);
    const AlignOptions align = AlignOptionsOf(map_->params, kind_);
    std::map<std::int32_t, double> nearest;  // by place
    for (const auto& [tree, entry] : retrieved) {
      const double distance = AlignByKey(view, tree->table.context(entry), align).distance;
      const auto [at, is_new] = nearest.emplace(tree->table.entry(entry).place, distance);
      if (!is_new) at->second = std::min(at->second, distance);
    }
    AppendNearest(*map_, nearest, query.num_answers, &answer);
    answer.times.match_ns = matching.Elapsed_ns();
    return answer;
  }

 private:
  /// One variant of every place.
  struct Tree {
    ContextTable table;
    std::optional<KeyIndex> index;
  };

  DescriptorKind kind_;
  const Map* map_ = nullptr;
  std::vector<Tree> trees_;  // the places as they are, then one per root shift or the double flip
};

}  // namespace

std::unique_ptr<Baseline> MakeSeveralTrees(const std::string& name) {
  for (const DescriptorKind kind : {DescriptorKind::kPolar, DescriptorKind::kCart}) {
    auto baseline = std::make_unique<SeveralTrees>(kind);
    if (baseline->name() == name) return baseline;
  }
  return nullptr;
}

}  // namespace scanloc::eval
