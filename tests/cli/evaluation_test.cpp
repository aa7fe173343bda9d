#include "cli/evaluation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "cli/eval_jobs.hpp"
#include "cli/eval_report.hpp"
#include "support/scan_files.hpp"
#include "support/small_map.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::cli {
namespace {

using nlohmann::json;
using test::TempDir;

constexpr std::uint64_t kSeed = 5;
constexpr int kNumPlaces = 8;

/// A small map whose places are 7 m apart, and scans of them.
class EvaluationTest : public testing::Test {
 protected:
  EvaluationTest() : localizer_(test::LocalizerOf(test::SmallMap(kSeed, kNumPlaces))) {
    for (int place = 0; place < kNumPlaces; ++place) {
      place_scans_.push_back(
          Write(absl::StrCat("map/", place, ".bin"), test::PlaceScan(kSeed, place)));
      EvalQuery query{
          .name = absl::StrCat("query ", place),
          .file = Write(absl::StrCat("query/", place, ".bin"), test::QueryScan(kSeed, place))};
      query.T_map_true = localizer_->map().places[static_cast<std::size_t>(place)].T_map_place *
                         PlanarOffset(0.3, 0.5 + 0.1 * place);
      queries_.push_back(query);
    }
    queries_.push_back({.name = "elsewhere", .file = Write("else.bin", scenes::PostScan(99, 80))});
  }

  dataset::ScanFile Write(const std::string& name, const PointCloud& points) {
    return {dir_.Write(name, test::KittiBytes(points)), name};
  }

  std::vector<MethodResult> Evaluated(const std::vector<std::string>& methods, int num_threads) {
    EvalOptions options{.within_m = {8.0, 1.0}, .num_threads = num_threads, .time_places = true};
    for (const std::string& name : methods) {
      options.methods.push_back(ParseEvalMethod(name).value());
    }
    options.place_scans = place_scans_;
    FindRevisits(localizer_->map(), 8.0, &queries_);
    return Evaluate(*localizer_, queries_, options, [](std::size_t) {}).value();
  }

  EvalReport Report(std::vector<MethodResult> results) {
    return {.map = "a.scanloc", .queries = queries_, .results = std::move(results)};
  }

  TempDir dir_;
  std::shared_ptr<const Localizer> localizer_;
  std::vector<dataset::ScanFile> place_scans_;
  std::vector<EvalQuery> queries_;
};

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

TEST(RunJobs, DoesAllAndTellsTheFirstErrorInOrder) {
  std::vector<int> num_done(50, 0);
  std::size_t told = 0;
  EXPECT_TRUE(RunJobs(
                  3, num_done.size(),
                  [&](std::size_t number, std::size_t worker) {
                    EXPECT_LT(worker, 3U);
                    ++num_done[number];
                    return absl::OkStatus();
                  },
                  [&](std::size_t num) { told = num; })
                  .ok());
  EXPECT_EQ(num_done, std::vector<int>(50, 1));
  EXPECT_EQ(told, 50U);
  // However soon they are done.
  for (int round = 0; round < 200; ++round) {
    told = 0;
    EXPECT_TRUE(RunJobs(
                    3, 3, [](std::size_t, std::size_t) { return absl::OkStatus(); },
                    [&](std::size_t num) { told = num; })
                    .ok());
    ASSERT_EQ(told, 3U);
  }
  const absl::Status failed = RunJobs(
      1, 10,
      [](std::size_t number, std::size_t) {
        return number < 4 ? absl::OkStatus() : absl::NotFoundError(absl::StrCat("job ", number));
      },
      [](std::size_t) {});
  EXPECT_EQ(failed, absl::NotFoundError("job 4"));
}

TEST_F(EvaluationTest, JudgesEveryMethodByTheSameTruth) {
  const std::vector<std::string> methods = {"auto",     "a-pc",       "a-cc:3",  "m2dp",
                                            "a-pc-key", "a-cc-trees", "pc-brute"};
  const std::vector<MethodResult> results = Evaluated(methods, 2);
  ASSERT_EQ(results.size(), 2 * methods.size());
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const MethodResult& result = results[i];
    EXPECT_EQ(result.name, methods[i]);
    EXPECT_EQ(result.within_m, 8.0);
    EXPECT_EQ(result.first_right.size(), std::size_t{kNumPlaces});
    EXPECT_EQ(result.scored.size(), queries_.size());
    EXPECT_FALSE(result.scored.back().is_revisit);
    EXPECT_EQ(result.divergences.size(), result.precision_recall.points.size());
    EXPECT_GT(result.times.total_ms, 0.0) << result.name;
    EXPECT_GT(result.times.describe_ms, 0.0) << result.name;
    EXPECT_GT(result.times.describe_place_ms, 0.0) << result.name;
    EXPECT_GE(result.times.total_p99_ms, result.times.total_ms);
    EXPECT_EQ(results[methods.size() + i].within_m, 1.0);
  }
  EXPECT_EQ(eval::RecallAt(1, results[0].first_right, results[0].num_candidates), 1.0);
  EXPECT_TRUE(results[0].yaw_deg.has_value());
  EXPECT_FALSE(results[3].yaw_deg.has_value()) << "a baseline tells no pose";
  EXPECT_EQ(results[1].num_candidates, 1);
  EXPECT_EQ(results[2].num_candidates, 3);
  EXPECT_EQ(results[5].num_candidates, 1);
  for (const std::size_t i : {0, 3, 4, 6}) EXPECT_GT(results[i].num_candidates, 10);
}

TEST_F(EvaluationTest, DoesNotDependOnTheThreads) {
  const std::vector<std::string> methods = {"auto", "a-pc:3", "m2dp", "a-pc-trees:2"};
  const std::vector<MethodResult> one = Evaluated(methods, 1);
  const std::vector<MethodResult> three = Evaluated(methods, 3);
  ASSERT_EQ(one.size(), three.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].first_right, three[i].first_right);
    for (std::size_t q = 0; q < queries_.size(); ++q) {
      EXPECT_EQ(one[i].scored[q].score, three[i].scored[q].score);
    }
  }
}

TEST_F(EvaluationTest, NeedsTheScansOfThePlacesForVectors) {
  place_scans_.clear();
  EvalOptions options{.methods = {ParseEvalMethod("m2dp").value()}};
  const auto refused = Evaluate(*localizer_, queries_, options, [](std::size_t) {});
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  options.methods = {ParseEvalMethod("a-pc-key").value()};
  EXPECT_TRUE(Evaluate(*localizer_, queries_, options, [](std::size_t) {}).ok());
}

TEST_F(EvaluationTest, SeesOnlyPlacesThatWereMapped) {
  for (EvalQuery& query : queries_) query.sees_until_ns = 0;  // all were mapped at 0
  for (const MethodResult& result :
       Evaluated({"auto", "a-pc", "m2dp", "a-cc-key", "a-pc-trees"}, 2)) {
    EXPECT_TRUE(result.first_right.empty());
    EXPECT_TRUE(result.precision_recall.points.empty());
  }
}

TEST_F(EvaluationTest, ReportHasNoValueWhereNothingCanBeSaid) {
  const std::vector<MethodResult> results = Evaluated({"a-pc:2", "m2dp"}, 1);
  const json document = json::parse(EvalAsJson(Report(results)));
  const json& few = document.at("results")[0];
  EXPECT_TRUE(few.at("recall_at_1").is_number());
  EXPECT_TRUE(few.at("recall_at_5").is_null()) << "of two candidates";
  EXPECT_TRUE(few.at("recall_at_10").is_null());
  EXPECT_TRUE(document.at("results")[1].at("recall_at_10").is_number());
  const std::vector<std::string> columns = EvalColumns();
  const std::vector<std::string> row = EvalRow(results[0]);
  ASSERT_EQ(row.size(), columns.size());
  EXPECT_EQ(columns[2], "recall@5");
  EXPECT_EQ(row[2], "-");

  MethodResult hopeless{.name = "hopeless", .within_m = 8.0, .first_right = {0, 0}};
  hopeless.scored.resize(queries_.size());
  const json nothing = json::parse(EvalAsJson(Report({hopeless}))).at("results")[0];
  EXPECT_EQ(nothing.at("recall_at_1"), 0.0);
  EXPECT_EQ(nothing.at("f1_max"), 0.0);
  for (const char* name : {"threshold_at_f1_max", "precision_at_f1_max", "divergence_at_f1_max",
                           "yaw_error_deg", "expected_calibration_error"}) {
    EXPECT_TRUE(nothing.at(name).is_null()) << name;
  }
  MethodResult nowhere = hopeless;
  nowhere.first_right.clear();
  const json no_revisit = json::parse(EvalAsJson(Report({nowhere}))).at("results")[0];
  EXPECT_TRUE(no_revisit.at("recall_at_1").is_null());
  EXPECT_TRUE(no_revisit.at("area_under_curve").is_null());
}

TEST_F(EvaluationTest, ReportNamesRightPosesWithoutAPlaceNear) {
  std::vector<MethodResult> results = Evaluated({"auto"}, 1);
  EXPECT_EQ(results[0].num_right_beyond, 0U);
  EXPECT_EQ(EvalAsTable(Report(results)).find("right pose"), std::string::npos);
  // Now with a limit smaller than the 0.3 m between the queries and their places.
  EvalOptions options{.methods = {ParseEvalMethod("auto").value()}, .within_m = {0.2}};
  FindRevisits(localizer_->map(), 0.2, &queries_);
  results = Evaluate(*localizer_, queries_, options, [](std::size_t) {}).value();
  EXPECT_GT(results[0].num_right_beyond, 0U);
  for (const eval::ScoredQuery& scored : results[0].scored) EXPECT_FALSE(scored.is_right);
  EvalReport report = Report(results);
  report.within_m = 0.2;
  EXPECT_EQ(json::parse(EvalAsJson(report)).at("results")[0].at("num_right_beyond"),
            results[0].num_right_beyond);
  EXPECT_NE(EvalAsTable(report).find("tell the right pose"), std::string::npos);
}

}  // namespace
}  // namespace scanloc::cli
