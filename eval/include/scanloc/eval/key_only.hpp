#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scanloc/core/scan_context/key_index.hpp"
#include "scanloc/eval/baseline.hpp"

namespace scanloc::eval {

/// The paper's methods without the check of the full descriptors (Sec. "Full descriptor's effect"):
/// places are ranked and matches accepted by the distance between retrieval keys alone [m].
class KeyOnly : public Baseline {
 public:
  KeyOnly(DescriptorKind kind, bool augmented) : kind_(kind), augmented_(augmented) {}

  [[nodiscard]] std::string name() const override;
  [[nodiscard]] std::optional<DescriptorKind> context_kind() const override { return kind_; }
  void Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) override;
  [[nodiscard]] Answer Recognize(const BaselineQuery& query) const override;

 private:
  DescriptorKind kind_;
  bool augmented_;  // keys of root shifts and double flips, too
  const Map* map_ = nullptr;
  std::optional<KeyIndex> index_;
};

/// pc-key, cc-key, a-pc-key or a-cc-key; null for any other name.
[[nodiscard]] std::unique_ptr<Baseline> MakeKeyOnly(const std::string& name);

}  // namespace scanloc::eval
