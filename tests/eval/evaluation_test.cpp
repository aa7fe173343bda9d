#include "scanloc/eval/evaluation.hpp"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "support/small_evaluation.hpp"

namespace scanloc::eval {
namespace {

using test::SmallEvaluation;

TEST(ParseEvalMethod, KnowsMethodsAndBaselines) {
  EXPECT_EQ(ParseEvalMethod("a-pc:7")->num_candidates, 7);
  EXPECT_FALSE(ParseEvalMethod("a-pc-brute")->is_baseline);
  for (const char* name : {"m2dp", "a-cc-key", "pc-key", "a-pc-trees"}) {
    ASSERT_TRUE(ParseEvalMethod(name).ok()) << name;
    EXPECT_TRUE(ParseEvalMethod(name)->is_baseline);
    EXPECT_EQ(ParseEvalMethod(name)->baseline, name);
  }
  EXPECT_EQ(ParseEvalMethod("a-cc-trees:3")->num_candidates, 3);
  EXPECT_EQ(ParseEvalMethod("a-cc-trees:3")->baseline, "a-cc-trees");
  for (const char* name : {"m2dp:3", "pc-key:1", "a-pc:0", "a-pc-trees:x", "orb", "pc-trees"}) {
    EXPECT_FALSE(ParseEvalMethod(name).ok()) << name;
  }
}

TEST(CheckServes, LooksAtTheContextsThatABaselineWorksOn) {
  Params params;
  params.cart.enabled = false;
  EXPECT_TRUE(CheckServes(params, ParseEvalMethod("a-pc-key").value()).ok());
  EXPECT_TRUE(CheckServes(params, ParseEvalMethod("m2dp").value()).ok());
  EXPECT_FALSE(CheckServes(params, ParseEvalMethod("a-cc-trees").value()).ok());
}

TEST(Evaluate, JudgesEveryMethodByTheSameTruth) {
  const std::vector<std::string> methods = {"auto",     "a-pc",       "a-cc:3",  "m2dp",
                                            "a-pc-key", "a-cc-trees", "pc-brute"};
  SmallEvaluation small;
  const std::vector<MethodResult> results = small.Run(methods, 2);
  ASSERT_EQ(results.size(), 2 * methods.size());
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const MethodResult& result = results[i];
    EXPECT_EQ(result.name, methods[i]);
    EXPECT_EQ(result.within_m, 8.0);
    EXPECT_EQ(result.first_right.size(), std::size_t{SmallEvaluation::kNumPlaces});
    EXPECT_EQ(result.scored.size(), small.queries.size());
    EXPECT_FALSE(result.scored.back().is_revisit);
    EXPECT_EQ(result.divergences.size(), result.precision_recall.points.size());
    EXPECT_GT(result.times.total_ms, 0.0) << result.name;
    EXPECT_GT(result.times.describe_ms, 0.0) << result.name;
    EXPECT_GT(result.times.describe_place_ms, 0.0) << result.name;
    EXPECT_GE(result.times.total_p99_ms, result.times.total_ms);
    EXPECT_EQ(results[methods.size() + i].within_m, 1.0);
  }
  EXPECT_EQ(RecallAt(1, results[0].first_right, results[0].num_candidates), 1.0);
  const OutcomeCounts& outcomes = results[0].outcomes;
  EXPECT_EQ(outcomes.num_queries, small.queries.size());
  EXPECT_EQ(outcomes.num_pose_right, std::size_t{SmallEvaluation::kNumPlaces});
  EXPECT_EQ(outcomes.num_localized, outcomes.num_localized_right + outcomes.num_false);
  EXPECT_TRUE(results[0].yaw_deg.has_value());
  EXPECT_FALSE(results[3].yaw_deg.has_value()) << "a baseline tells no pose";
  EXPECT_EQ(results[1].num_candidates, 1);
  EXPECT_EQ(results[2].num_candidates, 3);
  EXPECT_EQ(results[5].num_candidates, 1);
  for (const std::size_t i : {0, 3, 4, 6}) EXPECT_GT(results[i].num_candidates, 10);
}

TEST(Evaluate, DoesNotDependOnTheThreads) {
  const std::vector<std::string> methods = {"auto", "a-pc:3", "m2dp", "a-pc-trees:2"};
  SmallEvaluation small;
  const std::vector<MethodResult> one = small.Run(methods, 1);
  const std::vector<MethodResult> three = small.Run(methods, 3);
  ASSERT_EQ(one.size(), three.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].first_right, three[i].first_right);
    for (std::size_t q = 0; q < small.queries.size(); ++q) {
      EXPECT_EQ(one[i].scored[q].score, three[i].scored[q].score);
    }
  }
}

TEST(Evaluate, NeedsTheScansOfThePlacesForVectors) {
  SmallEvaluation small;
  small.options.read_place = nullptr;
  small.options.methods = {ParseEvalMethod("m2dp").value()};
  EXPECT_EQ(
      Evaluate(*small.localizer, small.queries, small.options, [](std::size_t) {}).status().code(),
      absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(small.Run({"a-pc-key"}).size(), 2U);
}

TEST(Evaluate, EndsWithTheFirstScanThatCannotBeRead) {
  SmallEvaluation small;
  small.options.methods = {ParseEvalMethod("a-pc").value()};
  small.options.read_query = [](std::size_t i) -> absl::StatusOr<PointCloud> {
    if (i >= 3) return absl::DataLossError(absl::StrCat("scan ", i));
    return PointCloud();
  };
  EXPECT_EQ(Evaluate(*small.localizer, small.queries, small.options, [](std::size_t) {}).status(),
            absl::DataLossError("scan 3"));
}

TEST(Evaluate, SeesOnlyPlacesThatWereMapped) {
  SmallEvaluation small;
  for (EvalQuery& query : small.queries) query.sees_until_ns = 0;  // all were mapped at 0
  for (const MethodResult& result :
       small.Run({"auto", "a-pc", "m2dp", "a-cc-key", "a-pc-trees"}, 2)) {
    EXPECT_TRUE(result.first_right.empty());
    EXPECT_TRUE(result.precision_recall.points.empty());
  }
}

}  // namespace
}  // namespace scanloc::eval
