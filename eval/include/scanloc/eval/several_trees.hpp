#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/scan_context/key_index.hpp"
#include "scanloc/eval/baseline.hpp"

namespace scanloc::eval {

/// The augmented methods with a k-d tree of its own for each variant, instead of one that holds the
/// original and the augmented keys (paper, Sec. V-D): the k nearest places of every tree are
/// compared by full descriptor, after pre-alignment, and the best is taken.
class SeveralTrees : public Baseline {
 public:
  explicit SeveralTrees(DescriptorKind kind) : kind_(kind) {}

  [[nodiscard]] std::string name() const override;
  [[nodiscard]] std::optional<DescriptorKind> context_kind() const override { return kind_; }
  [[nodiscard]] bool takes_candidates() const override { return true; }
  void Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) override;
  [[nodiscard]] Answer Recognize(const BaselineQuery& query) const override;

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

/// a-pc-trees or a-cc-trees; null for any other name.
[[nodiscard]] std::unique_ptr<Baseline> MakeSeveralTrees(const std::string& name);

}  // namespace scanloc::eval
