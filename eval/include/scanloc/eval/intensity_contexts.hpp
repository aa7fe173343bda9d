#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "scanloc/core/params.hpp"
#include "scanloc/eval/context_baseline.hpp"

namespace scanloc::eval {

/// What intensities are of.
enum class IntensitySource {
  kLidar,  ///< a bin holds the greatest of its points, as Intensity Scan Context has it
  kRadar,  ///< the mean of its pixels, as an image of a radar that is scaled down has it
};

/// Contexts of intensities in place of heights, whatever their unit: the greatest that a context of
/// the map holds becomes Context::kMaxHeight_cm.
///
/// The scans of an evaluation have none, so that every query and place is encoded before and taken
/// by number.
class IntensityContexts : public ContextBaseline {
 public:
  IntensityContexts(DescriptorKind kind, bool augmented, IntensitySource source,
                    const Params& params);

  [[nodiscard]] bool needs_place_scans() const override { return false; }

  /// The cells of the context, column by column, and of a place those of each root shift. Requires
  /// an intensity a point, finite and not negative.
  [[nodiscard]] Eigen::VectorXf Encode(PointView points, std::span<const float> intensities,
                                       bool of_place) const;

  /// Before Prepare: what Encode makes of every query and of every place.
  void Take(std::vector<Eigen::VectorXf> of_queries, std::vector<Eigen::VectorXf> of_places);
  /// Takes what was encoded.
  void Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) override;

 protected:
  [[nodiscard]] std::vector<std::uint16_t> CellsOf(const BaselineQuery& query) const override;

 private:
  IntensitySource source_;
  std::vector<Eigen::VectorXf> of_queries_;
  std::vector<Eigen::VectorXf> of_places_;
  float scale_ = 0.0F;
};

/// pc, cc, a-pc or a-cc, and -intensity or -radar; null for any other name.
[[nodiscard]] std::unique_ptr<IntensityContexts> MakeIntensityContexts(const std::string& name,
                                                                       const Params& params);

}  // namespace scanloc::eval
