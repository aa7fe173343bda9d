#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan_context/key_index.hpp"
#include "scanloc/eval/baseline.hpp"

namespace scanloc::eval {

/// The paper's method, pc, cc, a-pc or a-cc, that stands before -VALUE in a name; none: another
/// name.
[[nodiscard]] std::optional<Method> ContextMethodOf(const std::string& name,
                                                    const std::string& value);

/// The nearest that a cell can hold.
[[nodiscard]] std::uint16_t CellOf(double value);

/// The paper's methods over contexts whose bins hold something else than the greatest height
/// (paper, Sec. "Bin Encoding Function"): bins, keys, candidates, alignment and augmentation are
/// those of the map's parameters.
class ContextBaseline : public Baseline {
 public:
  /// `value` says what the bins hold; the baseline is named METHOD-VALUE.
  ContextBaseline(DescriptorKind kind, bool augmented, std::string value, const Params& params);

  [[nodiscard]] std::string name() const override { return name_; }
  [[nodiscard]] bool takes_candidates() const override { return true; }

  /// Takes the cells of the context of each place, column by column, then those of each root shift:
  /// whole numbers in [0, Context::kMaxHeight_cm].
  void Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) override;
  [[nodiscard]] Answer Recognize(const BaselineQuery& query) const override;

 protected:
  /// Those of the query, without root shifts.
  [[nodiscard]] virtual std::vector<std::uint16_t> CellsOf(const BaselineQuery& query) const = 0;

  [[nodiscard]] const Params& params() const { return params_; }
  [[nodiscard]] std::size_t num_cells() const;
  /// The bin of a position in the sensor frame, as Describer has it; none: outside.
  [[nodiscard]] std::optional<std::size_t> BinOf(double x_m, double y_m) const;
  /// 0, and the root shifts of a place.
  [[nodiscard]] std::vector<double> Shifts_m() const;

 private:
  [[nodiscard]] int num_rows() const;
  [[nodiscard]] int num_cols() const;

  DescriptorKind kind_;
  bool augmented_;
  std::string name_;
  Params params_;
  const Map* map_ = nullptr;
  ContextTable table_;
  std::optional<KeyIndex> index_;
};

}  // namespace scanloc::eval
