#include "scanloc/eval/intensity_contexts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scanloc/core/scan/descriptor.hpp"
#include "support/small_evaluation.hpp"

namespace scanloc::eval {
namespace {

using ::testing::HasSubstr;

/// A brightness for each point that any sensor would see: of its height and where it stands.
std::vector<float> Brightness(const PointCloud& scan) {
  std::vector<float> values;
  for (const Point& p : scan) values.push_back(std::max(0.0F, p.z + 2.0F));
  return values;
}

TEST(IntensityContexts, HoldTheGreatestOfAScanAndTheMeanOfARadarImage) {
  // Two in one bin, one in another, one beyond the range.
  const PointCloud points = {
      {21.1F, 3.1F, 0.0F}, {21.2F, 3.2F, 5.0F}, {-9.0F, 1.0F, 0.0F}, {900, 0, 0}};
  const std::vector<float> intensities = {10.0F, 30.0F, 5.0F, 1000.0F};
  for (const std::string kind : {"pc", "cc", "a-cc"}) {
    const auto of = [&](const std::string& value) {
      return MakeIntensityContexts(kind + value, {})->Encode(points, intensities, true);
    };
    EXPECT_EQ(of("-intensity").maxCoeff(), 30.0F);
    EXPECT_EQ(of("-intensity").sum(), 35.0F);
    EXPECT_EQ(of("-radar").maxCoeff(), 20.0F);
    EXPECT_EQ(of("-radar").sum(), 25.0F);
  }
  EXPECT_EQ(MakeIntensityContexts("a-pc-radar", {})->Encode({}, {}, true).size(), 3 * 20 * 60);
  EXPECT_EQ(MakeIntensityContexts("a-pc-radar", {})->Encode({}, {}, false).size(), 20 * 60);
}

TEST(IntensityContexts, StandInTheBinsOfTheDescriber) {
  const PointCloud points = {{12.0F, -30.0F, 1.0F}};
  const auto known = Describer::Create({}).value().Describe(points);
  const std::vector<float> one = {1.0F};
  const Eigen::VectorXf cells = MakeIntensityContexts("pc-radar", {})->Encode(points, one, false);
  for (std::size_t i = 0; i < known.polar.cells_cm.size(); ++i) {
    EXPECT_EQ(cells(static_cast<Eigen::Index>(i)) > 0.0F, known.polar.cells_cm[i] > 0) << i;
  }
}

/// What a method makes of a small evaluation whose points are so much brighter in the map.
std::vector<MethodResult> Evaluated(test::SmallEvaluation* small, const std::string& name,
                                    float unit) {
  std::shared_ptr<IntensityContexts> baseline =
      MakeIntensityContexts(name, small->localizer->map().params);
  std::vector<Eigen::VectorXf> of_queries, of_places;
  const auto encode = [&](const PointCloud& scan, float times, bool of_place) {
    std::vector<float> values = Brightness(scan);
    for (float& value : values) value *= times;
    return baseline->Encode(scan, values, of_place);
  };
  for (std::size_t i = 0; i < small->queries.size(); ++i) {
    of_queries.push_back(encode(small->options.read_query(i).value(), unit, false));
  }
  for (std::size_t i = 0; i < small->localizer->map().places.size(); ++i) {
    of_places.push_back(encode(small->options.read_place(i).value(), unit, true));
  }
  baseline->Take(of_queries, of_places);
  small->options.baselines = {baseline};
  return small->Run({name + ":3"}, 2);
}

TEST(IntensityContexts, RecognisePlacesInWhateverUnit) {
  for (const std::string name : {"a-pc-intensity", "pc-intensity", "a-pc-radar"}) {
    test::SmallEvaluation small;
    const std::vector<MethodResult> fine = Evaluated(&small, name, 0.001F);
    EXPECT_GE(*RecallAt(1, fine[0].first_right, 3), 0.7) << name;
    const std::vector<MethodResult> coarse = Evaluated(&small, name, 1000.0F);
    ASSERT_EQ(fine[0].scored.size(), coarse[0].scored.size());
    for (std::size_t i = 0; i < fine[0].scored.size(); ++i) {
      EXPECT_NEAR(fine[0].scored[i].score, coarse[0].scored[i].score, 1e-4) << name << " " << i;
    }
  }
}

TEST(IntensityContexts, FindNothingInTheDark) {
  test::SmallEvaluation small;
  const std::vector<MethodResult> dark = Evaluated(&small, "pc-intensity", 0.0F);
  EXPECT_EQ(dark[0].precision_recall.recall_at_full_precision, 0.0);
}

TEST(IntensityContexts, AreRefusedWhereNobodyReadsThem) {
  test::SmallEvaluation small;
  small.options.methods = {ParseEvalMethod("a-pc-radar:2").value()};
  EXPECT_TRUE(CheckServes({}, small.options.methods[0]).ok());
  const auto results = Evaluate(*small.localizer, small.queries, small.options, [](std::size_t) {});
  EXPECT_EQ(results.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(results.status().message()), HasSubstr("a-pc-radar:2 works on"));
  for (const char* name : {"auto-radar", "pc-naive-radar", "radar", "m2dp-intensity"}) {
    EXPECT_FALSE(ParseEvalMethod(name).ok()) << name;
  }
}

}  // namespace
}  // namespace scanloc::eval
