#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/voxel_filter.hpp"
#include "scanloc/eval/context_baseline.hpp"
#include "shared.hpp"

namespace scanloc::eval {
namespace {

/// What a bin of a context holds of the voxels in it, in place of the greatest height.
enum class BinValue {
  kMean,   ///< mean height [cm]
  kCount,  ///< how many there are
  /// Which heights are occupied: one bit a metre above ground, the eighth for all that is higher,
  /// as LiDAR Iris has it.
  kBits,
};

constexpr std::array<std::pair<BinValue, const char*>, 3> kValueNames = {
    {{BinValue::kMean, "mean"}, {BinValue::kCount, "count"}, {BinValue::kBits, "bits"}}};
constexpr int kNumBits = 8;

/// What is gathered of the voxels in a bin.
struct Bin {
  double sum_cm = 0.0;
  int count = 0;
  unsigned bits = 0;

  void Add(double height_m) {
    sum_cm += 100.0 * height_m;
    ++count;
    bits |= 1U << static_cast<unsigned>(std::clamp(height_m, 0.0, kNumBits - 1.0));
  }

  [[nodiscard]] std::uint16_t Value(BinValue value) const {
    if (count == 0) return 0;
    double number = 0.0;
    if (value == BinValue::kMean) number = sum_cm / count;
    if (value == BinValue::kCount) number = count;
    if (value == BinValue::kBits) number = bits;
    return CellOf(number);
  }
};

/// Contexts of such values.
class BinEncoding : public ContextBaseline {
 public:
  BinEncoding(DescriptorKind kind, bool augmented, BinValue value, const Params& params)
      : ContextBaseline(kind, augmented, kValueNames[static_cast<std::size_t>(value)].second,
                        params),
        value_(value) {}

  [[nodiscard]] Eigen::VectorXf Describe(PointView scan) const override {
    VoxelFilter filter(params().voxel_size_m);
    const PointCloud& voxels = filter.Apply(scan);
    std::vector<float> all;
    for (const double shift_m : Shifts_m()) {
      const std::vector<std::uint16_t> cells = Encode(voxels, shift_m);
      all.insert(all.end(), cells.begin(), cells.end());
    }
    return Eigen::Map<const Eigen::VectorXf>(all.data(), static_cast<Eigen::Index>(all.size()));
  }

 protected:
  [[nodiscard]] std::vector<std::uint16_t> CellsOf(const BaselineQuery& query) const override {
    VoxelFilter filter(params().voxel_size_m);
    return Encode(filter.Apply(query.scan), 0.0);
  }

 private:
  [[nodiscard]] std::vector<std::uint16_t> Encode(const PointCloud& voxels, double shift_m) const {
    std::vector<Bin> bins(num_cells());
    for (const Point& p : voxels) {
      if (const std::optional<std::size_t> bin = BinOf(p.x, p.y - shift_m)) {
        bins[*bin].Add(p.z + params().sensor_height_m);
      }
    }
    std::vector<std::uint16_t> cells;
    cells.reserve(bins.size());
    for (const Bin& bin : bins) cells.push_back(bin.Value(value_));
    return cells;
  }

  BinValue value_;
};

}  // namespace

std::unique_ptr<Baseline> MakeBinEncoding(const std::string& name, const Params& params) {
  for (const auto& [value, text] : kValueNames) {
    if (const auto method = ContextMethodOf(name, text)) {
      return std::make_unique<BinEncoding>(method->kind, method->augmented, value, params);
    }
  }
  return nullptr;
}

}  // namespace scanloc::eval
