#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "scanloc/core/params.hpp"
#include "scanloc/eval/context_baseline.hpp"

namespace scanloc::eval {

/// What a bin of a context holds of the voxels in it, in place of the greatest height.
enum class BinValue {
  kMean,   ///< mean height [cm]
  kCount,  ///< how many there are
  /// Which heights are occupied: one bit a metre above ground, the eighth for all that is higher,
  /// as LiDAR Iris has it.
  kBits,
};

/// Contexts of such values.
class BinEncoding : public ContextBaseline {
 public:
  BinEncoding(DescriptorKind kind, bool augmented, BinValue value, const Params& params);

  [[nodiscard]] Eigen::VectorXf Describe(PointView scan) const override;

 protected:
  [[nodiscard]] std::vector<std::uint16_t> CellsOf(const BaselineQuery& query) const override;

 private:
  [[nodiscard]] std::vector<std::uint16_t> Encode(const PointCloud& voxels, double shift_m) const;

  BinValue value_;
};

/// pc, cc, a-pc or a-cc, and -mean, -count or -bits; null for any other name.
[[nodiscard]] std::unique_ptr<Baseline> MakeBinEncoding(const std::string& name,
                                                        const Params& params);

}  // namespace scanloc::eval
