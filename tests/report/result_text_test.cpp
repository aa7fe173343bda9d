#include "scanloc/report/result_text.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace scanloc::report {
namespace {

using nlohmann::json;

QueryResult MakeResult() {
  Candidate best;
  best.place = 7;
  best.session_name = "north, late";
  best.T_map_place.translation() = Eigen::Vector3d(10.0, 20.0, 1.5);
  best.distance = 0.125;
  best.yaw_rad = -1.5707963267948966;
  best.lateral_m = -2.0;
  best.T_map_query = best.T_map_place * PlanarOffset(best.lateral_m, best.yaw_rad);
  Candidate second = best;
  second.place = 9;
  second.confidence = 0.5;
  QueryResult result;
  result.query = "a.bin";
  result.answer.outcome = Outcome::kLocalized;
  result.answer.reason = "near";
  result.answer.candidates = {best, second};
  result.answer.content_id = "abc";
  return result;
}

QueryResult MakeEmptyResult() {
  QueryResult result;
  result.query = "b.bin";
  result.answer.outcome = Outcome::kInsufficientScan;
  return result;
}

TEST(ResultsAsCsv, HoldsTheDocumentedColumnsOnly) {
  EXPECT_EQ(ResultsAsCsv({MakeResult(), MakeEmptyResult()}, {}),
            "query,outcome,place,session,distance,confidence,yaw_deg,lateral_m,x,y,z,qx,qy,qz,qw"
            ",heading_deg,std_x_m,std_y_m,std_z_m,std_roll_deg,std_pitch_deg,std_yaw_deg\n"
            "a.bin,localized,7,\"north, late\",0.125000,,-90.000000000,-2.000000000,"
            "10.000000000,18.000000000,1.500000000,"
            "0.000000000,0.000000000,-0.707106781,0.707106781,-90.000000000,,,,,,\n"
            "b.bin,insufficient_scan,,,,,,,,,,,,,,,,,,,,\n");
}

TEST(ResultsAsCsv, TellsTheMapWhereSeveralWereAsked) {
  QueryResult result = MakeResult();
  result.answer.candidates.front().map = "south";
  const ResultFormat format{.several_maps = true};
  const std::string csv = ResultsAsCsv({result, MakeEmptyResult()}, format);
  EXPECT_NE(csv.find(",std_yaw_deg,map\na.bin,"), std::string::npos) << csv;
  EXPECT_NE(csv.find(",south\nb.bin,"), std::string::npos) << csv;
  EXPECT_NE(ResultsAsTable({result}, format).find("south"), std::string::npos);
  const json best = json::parse(ResultsAsJson({result}, "auto", format));
  EXPECT_EQ(best.at("queries")[0].at("candidates")[0].at("map"), "south");
}

TEST(ResultsAsCsv, TellsWhereOnEarthOnlyWhereThatIsKnown) {
  QueryResult result = MakeResult();
  const ResultFormat format{.geo = true};
  result.answer.candidates.front().geo = GeoPose{48.1374, -11.5, 519.5, 359.25};
  const std::string csv = ResultsAsCsv({result, MakeEmptyResult()}, format);
  EXPECT_NE(csv.find(",std_yaw_deg,latitude,longitude,altitude,true_heading_deg\na.bin,"),
            std::string::npos)
      << csv;
  EXPECT_NE(csv.find(",48.137400000,-11.500000000,519.500000000,359.250000000\n"),
            std::string::npos)
      << csv;
  EXPECT_EQ(csv.substr(csv.size() - 5), ",,,,\n");
  EXPECT_NE(ResultsAsTable({result, MakeEmptyResult()}, format).find("48.1374000"),
            std::string::npos);
  const json told = json::parse(ResultsAsJson({result}, "auto", format)).at("queries")[0];
  EXPECT_EQ(told.at("candidates")[0].at("geo").at("heading_deg"), 359.25);
  EXPECT_FALSE(told.at("candidates")[1].contains("geo"));
}

TEST(ResultsAsCsv, TellsDeviationsInMetresAndDegrees) {
  QueryResult result = MakeResult();
  Eigen::Matrix<double, 6, 1> variances;
  variances << 0.04, 0.01, 0.0025, 1e-4, 4e-4, 9e-4;
  result.answer.candidates.front().covariance = variances.asDiagonal();
  EXPECT_NE(ResultsAsCsv({result}, {})
                .find(",-90.000000000,0.200000,0.100000,0.050000,0.572958,1.145916,1.718873\n"),
            std::string::npos);
  const json best = json::parse(ResultsAsJson({result}, "auto", {})).at("queries")[0]["candidates"];
  EXPECT_EQ(best[0].at("std_y_m"), 0.1);
  EXPECT_EQ(best[0].at("covariance").size(), 36U);
  EXPECT_EQ(best[0].at("heading_deg"), -90.0);
  EXPECT_EQ(best[1].at("covariance"), nullptr);
}

TEST(ResultsAsCsv, AppendsRankAndTruth) {
  QueryResult result = MakeResult();
  result.T_map_true = Pose::Identity();
  result.T_map_true->translation() = Eigen::Vector3d(10.0, 17.0, 0.0);
  const std::string csv =
      ResultsAsCsv({result, MakeEmptyResult()}, {.all_candidates = true, .truth = true});
  EXPECT_NE(csv.find(",qw,rank,true_place_error_m,error_m,yaw_error_deg,true_x,true_y,"
                     "height_error_m,missed,heading_deg,"),
            std::string::npos);
  const std::string end =
      ",3.000000000,1.000000000,90.000000000,10.000000000,17.000000000,"
      "1.500000000,height+heading,-90.000000000,,,,,,\n";
  EXPECT_NE(csv.find(",1" + end + "a.bin,localized,9,\"north, late\",0.125000,0.500000,"),
            std::string::npos)
      << csv;
  EXPECT_NE(csv.find(",2" + end), std::string::npos) << csv;
  EXPECT_NE(csv.find("\nb.bin,insufficient_scan,,,,,,,,,,,,,,,,,,,,,,,,,,,,\n"), std::string::npos)
      << csv;
}

TEST(ResultsAsJson, HoldsAllCandidatesAndNoTimes) {
  QueryResult result = MakeResult();
  const std::string text = ResultsAsJson({result, MakeEmptyResult()}, "a-pc", {});
  const json document = json::parse(text);
  EXPECT_EQ(document.at("content_id"), "abc");
  EXPECT_EQ(document.at("method"), "a-pc");
  const json& queries = document.at("queries");
  ASSERT_EQ(queries.size(), 2U);
  EXPECT_EQ(queries[0].at("reason"), "near");
  ASSERT_EQ(queries[0].at("candidates").size(), 2U);
  EXPECT_EQ(queries[0].at("candidates")[0].at("confidence"), nullptr);
  EXPECT_EQ(queries[0].at("candidates")[1].at("confidence"), 0.5);
  EXPECT_EQ(queries[0].at("candidates")[0].at("T_map_query").at("y"), 18.0);
  EXPECT_EQ(queries[1].at("candidates").size(), 0U);
  EXPECT_EQ(document.at("summary").at("num_localized"), 1);
  result.ask_ns = 1'000'000;
  result.answer.times.match_ns = 5;
  EXPECT_EQ(ResultsAsJson({result, MakeEmptyResult()}, "a-pc", {}), text);
}

TEST(ResultsAsJson, StaysJsonWhateverAFileIsNamed) {
  QueryResult result = MakeResult();
  result.query = "\xFF\"\\\n\x01.bin";
  EXPECT_TRUE(json::accept(ResultsAsJson({result}, "pc", {})));
}

TEST(ResultsAsTable, ShowsTheBestOrAllCandidates) {
  const auto num_lines = [](const std::string& text) {
    return std::count(text.begin(), text.end(), '\n');
  };
  const std::vector<QueryResult> results = {MakeResult(), MakeEmptyResult()};
  EXPECT_EQ(num_lines(ResultsAsTable(results, {})), 3);
  EXPECT_EQ(num_lines(ResultsAsTable(results, {.all_candidates = true, .truth = true})), 4);
}

TEST(SummaryText, SaysWhichOfTheThreeWasMissed) {
  QueryResult result = MakeResult();
  result.T_map_true = result.answer.candidates.front().T_map_query;
  result.T_map_true->translation().z() += 3.5;
  const std::string text = SummaryText({result}, {.truth = true});
  EXPECT_NE(text.find("localized wrong   1 of 1 (100.0 %): 0 missed in the plane, 1 in height, "
                      "0 in heading"),
            std::string::npos)
      << text;
  const json summary = json::parse(ResultsAsJson({result}, "auto", {.truth = true})).at("summary");
  EXPECT_EQ(summary.at("num_false"), 1);
  EXPECT_EQ(summary.at("num_localized_right"), 0);
  EXPECT_EQ(summary.at("num_insufficient"), 0);
}

TEST(SummaryText, StandsWithoutAnyQuery) {
  EXPECT_NE(SummaryText({}, {.truth = true}).find("0 of 0"), std::string::npos);
}

}  // namespace
}  // namespace scanloc::report
