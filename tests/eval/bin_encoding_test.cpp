#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/eval/baseline.hpp"
#include "support/scenes.hpp"
#include "support/small_evaluation.hpp"

namespace scanloc::eval {
namespace {

using ::testing::Each;
using ::testing::Ge;
using ::testing::Lt;

/// What Describe puts where the encoding of the greatest height has its only cell.
float OnlyValue(const std::string& name, const PointCloud& scan) {
  const Params params;
  const Eigen::VectorXf cells = MakeBaseline(name, params)->Describe(scan);
  const ScanDescriptor known = Describer::Create(params).value().Describe(scan);
  const Context& context = name.find("pc") == std::string::npos ? known.cart : known.polar;
  float value = 0.0F;
  for (std::size_t i = 0; i < context.cells_cm.size(); ++i) {
    const float cell = cells(static_cast<Eigen::Index>(i));
    EXPECT_EQ(cell > 0.0F, context.cells_cm[i] > 0) << name << " " << i;
    if (cell > 0.0F) value = cell;
  }
  return value;
}

TEST(BinEncoding, FillsTheBinsOfTheContextWithItsValue) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  // Voxels of one bin, 0.5, 2.5 and 12 m above ground: the sensor is at 2 m.
  const PointCloud scan = {
      {21.1F, 3.1F, -1.5F}, {21.1F, 3.1F, 0.5F}, {21.1F, 3.1F, 10.0F}, {kNan, 0.0F, 0.0F}};
  for (const std::string kind : {"pc", "cc", "a-cc"}) {
    EXPECT_EQ(OnlyValue(kind + "-mean", scan), 500.0F);
    EXPECT_EQ(OnlyValue(kind + "-count", scan), 3.0F);
    EXPECT_EQ(OnlyValue(kind + "-bits", scan), 1.0F + 4.0F + 128.0F);
  }
  EXPECT_EQ(MakeBaseline("a-pc-mean", {})->Describe(scan).size(), 3 * 20 * 60);
  EXPECT_TRUE(MakeBaseline("pc-mean", {})->Describe({}).isZero());
}

TEST(BinEncoding, HasTheBinsOfTheContextsForAnyPoint) {
  const PointCloud scan = scenes::RandomScan(5, 3000);
  const Params params;
  const ScanDescriptor known = Describer::Create(params).value().Describe(scan);
  for (const bool is_polar : {true, false}) {
    const Eigen::VectorXf counts =
        MakeBaseline(is_polar ? "pc-count" : "cc-count", params)->Describe(scan);
    EXPECT_EQ(counts.size(), is_polar ? 20 * 60 : 40 * 40);
    const std::vector<std::uint16_t>& cells = is_polar ? known.polar.cells_cm : known.cart.cells_cm;
    std::size_t num_apart = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      num_apart += cells[i] > 0 && counts(static_cast<Eigen::Index>(i)) == 0.0F ? 1 : 0;
    }
    EXPECT_LE(num_apart, cells.size() / 200) << "but for points on the edge of a bin";
  }
}

/// Of each kind and value, recall at 1 of three candidates.
std::vector<double> Recalls(test::SmallEvaluation* small, const std::string& kind) {
  std::vector<double> recalls;
  for (const char* value : {"-mean", "-count", "-bits"}) {
    const std::vector<MethodResult> results = small->Run({kind + value + ":3"}, 2);
    EXPECT_EQ(results[0].num_candidates, 3);
    EXPECT_GT(results[0].times.match_ms, 0.0);
    recalls.push_back(*RecallAt(1, results[0].first_right, results[0].num_candidates));
  }
  return recalls;
}

TEST(BinEncoding, RecognisesPlacesWhateverTheHeadingWithPolarContexts) {
  test::SmallEvaluation small;
  for (const char* kind : {"pc", "a-pc"}) {
    EXPECT_THAT(Recalls(&small, kind), Each(Ge(0.7))) << kind;
  }
}

TEST(BinEncoding, RecognisesReversedVehiclesOnlyWithFlips) {
  test::SmallEvaluation small;
  bool is_reversed = false;
  small.options.read_query = [&](std::size_t i) -> absl::StatusOr<PointCloud> {
    absl::StatusOr<PointCloud> scan = small.options.read_place(i);
    if (!scan.ok() || !is_reversed) return scan;
    for (Point& p : *scan) p = {-p.x, -p.y, p.z};
    return scan;
  };
  EXPECT_THAT(Recalls(&small, "cc"), Each(1.0));
  EXPECT_THAT(Recalls(&small, "a-cc"), Each(1.0));
  is_reversed = true;
  EXPECT_THAT(Recalls(&small, "cc"), Each(Lt(0.7)));
  EXPECT_THAT(Recalls(&small, "a-cc"), Each(1.0));
}

}  // namespace
}  // namespace scanloc::eval
