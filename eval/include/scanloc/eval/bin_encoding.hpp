#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan_context/key_index.hpp"
#include "scanloc/eval/baseline.hpp"

namespace scanloc::eval {

/// What a bin of a context holds (paper, Sec. "Bin Encoding Function") in place of the greatest
/// height, of the voxels in it.
enum class BinValue {
  kMean,   ///< mean height [cm]
  kCount,  ///< how many there are
  /// Which heights are occupied: one bit a metre above ground, the eighth for all that is higher,
  /// as LiDAR Iris has it.
  kBits,
};

/// The paper's methods over contexts of other values: bins, keys, candidates, alignment and
/// augmentation are those of the map's parameters.
class BinEncoding : public Baseline {
 public:
  BinEncoding(DescriptorKind kind, bool augmented, BinValue value, const Params& params)
      : kind_(kind), augmented_(augmented), value_(value), params_(params) {}

  [[nodiscard]] std::string name() const override;
  [[nodiscard]] bool takes_candidates() const override { return true; }

  /// The cells of the context, column by column, then those of each root shift.
  [[nodiscard]] Eigen::VectorXf Describe(PointView scan) const override;

  void Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) override;
  [[nodiscard]] Answer Recognize(const BaselineQuery& query) const override;

 private:
  [[nodiscard]] int num_rows() const;
  [[nodiscard]] int num_cols() const;
  /// The bin of a position in the sensor frame, as Describer has it; none: outside.
  [[nodiscard]] std::optional<std::size_t> BinOf(double x_m, double y_m) const;
  [[nodiscard]] std::vector<std::uint16_t> Encode(const PointCloud& voxels, double shift_m) const;
  [[nodiscard]] bool has_flips() const;

  DescriptorKind kind_;
  bool augmented_;
  BinValue value_;
  Params params_;
  const Map* map_ = nullptr;
  ContextTable table_;
  std::optional<KeyIndex> index_;
};

/// pc, cc, a-pc or a-cc, and -mean, -count or -bits; null for any other name.
[[nodiscard]] std::unique_ptr<Baseline> MakeBinEncoding(const std::string& name,
                                                        const Params& params);

}  // namespace scanloc::eval
