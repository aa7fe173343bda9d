#include "scanloc/report/eval_report.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/small_evaluation.hpp"

namespace scanloc::report {
namespace {

using nlohmann::json;

EvalReport ReportOf(const test::SmallEvaluation& small, std::vector<eval::MethodResult> results) {
  return {.map = "a.scanloc", .queries = small.queries, .results = std::move(results)};
}

TEST(EvalReport, HasNoValueWhereNothingCanBeSaid) {
  test::SmallEvaluation small;
  const std::vector<eval::MethodResult> results = small.Run({"a-pc:2", "m2dp"});
  const json document = json::parse(EvalAsJson(ReportOf(small, results)));
  const json& few = document.at("results")[0];
  EXPECT_TRUE(few.at("recall_at_1").is_number());
  EXPECT_EQ(few.at("num_localized_right").get<int>() + few.at("num_false").get<int>(),
            few.at("num_localized").get<int>());
  EXPECT_TRUE(few.at("recall_at_5").is_null()) << "of two candidates";
  EXPECT_TRUE(few.at("recall_at_10").is_null());
  EXPECT_TRUE(document.at("results")[1].at("recall_at_10").is_number());
  const std::vector<std::string> columns = EvalColumns();
  const std::vector<std::string> row = EvalRow(results[0]);
  ASSERT_EQ(row.size(), columns.size());
  EXPECT_EQ(columns[2], "recall@5");
  EXPECT_EQ(row[2], "-");
  EXPECT_EQ(OutcomeRow(results[0])[6], "0") << "ambiguous";
  for (const std::string& cell : OutcomeRow(results[1])) {
    EXPECT_TRUE(cell == "m2dp" || cell == "-") << cell << ": a baseline tells no outcome";
  }

  eval::MethodResult hopeless{.name = "hopeless", .within_m = 8.0, .first_right = {0, 0}};
  hopeless.scored.resize(small.queries.size());
  const json nothing = json::parse(EvalAsJson(ReportOf(small, {hopeless}))).at("results")[0];
  EXPECT_EQ(nothing.at("recall_at_1"), 0.0);
  EXPECT_EQ(nothing.at("f1_max"), 0.0);
  for (const char* name : {"threshold_at_f1_max", "precision_at_f1_max", "divergence_at_f1_max",
                           "yaw_error_deg", "expected_calibration_error"}) {
    EXPECT_TRUE(nothing.at(name).is_null()) << name;
  }
  eval::MethodResult nowhere = hopeless;
  nowhere.first_right.clear();
  const json no_revisit = json::parse(EvalAsJson(ReportOf(small, {nowhere}))).at("results")[0];
  EXPECT_TRUE(no_revisit.at("recall_at_1").is_null());
  EXPECT_TRUE(no_revisit.at("area_under_curve").is_null());
}

TEST(EvalReport, NamesRightPosesWithoutAPlaceNear) {
  test::SmallEvaluation small;
  std::vector<eval::MethodResult> results = small.Run({"auto"});
  EXPECT_EQ(results[0].num_right_beyond, 0U);
  EXPECT_EQ(EvalAsTable(ReportOf(small, results)).find("right pose"), std::string::npos);
  // Now with a limit smaller than the 0.3 m between the queries and their places.
  small.options.within_m = {0.2};
  results = small.Run({"auto"});
  EXPECT_GT(results[0].num_right_beyond, 0U);
  for (const eval::ScoredQuery& scored : results[0].scored) EXPECT_FALSE(scored.is_right);
  EvalReport report = ReportOf(small, results);
  report.within_m = 0.2;
  EXPECT_EQ(json::parse(EvalAsJson(report)).at("results")[0].at("num_right_beyond"),
            results[0].num_right_beyond);
  EXPECT_NE(EvalAsTable(report).find("tell the right pose"), std::string::npos);
}

}  // namespace
}  // namespace scanloc::report
