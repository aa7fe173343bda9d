#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scanloc/report/eval_report.hpp"

namespace scanloc::report {
namespace {

int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) {
    ++count;
  }
  return count;
}

/// How a made method answers the i-th query.
enum class Answered { kRight, kWrong, kNot };

/// A street there and back: places every meter, queries beside them, every fourth from elsewhere.
EvalReport MakeReport(std::size_t num_queries) {
  EvalReport report{.map = "street.scanloc", .content_id = "0123"};
  for (std::size_t i = 0; i < num_queries; ++i) {
    const auto at_m = static_cast<double>(i);
    report.places.push_back({Eigen::Vector2d(at_m, 10.0 * std::sin(at_m / 40.0)), 0});
    eval::EvalQuery query{.name = absl::StrCat(i, ".bin")};
    if (i % 4 != 3) {
      query.T_map_true = Pose::Identity();
      query.T_map_true->translation().head<2>() = report.places[i].position;
      query.stamp_ns = static_cast<std::int64_t>(i) * 500'000'000;
      query.is_revisit = true;
      query.has_place = true;
      // Of every kind in turn.
      query.variance = {i % 3 == 0 ? 0.7 : 3.2, i % 5 == 0 ? 4.0 : 174.0};
    }
    report.queries.push_back(std::move(query));
  }
  return report;
}

template <typename AnswerTo>
void AddResult(const std::string& name, AnswerTo&& answer_to, EvalReport* report) {
  eval::MethodResult result{.name = name, .within_m = report->within_m};
  for (std::size_t i = 0; i < report->queries.size(); ++i) {
    const eval::EvalQuery& query = report->queries[i];
    const Answered answered = answer_to(i);
    result.scored.push_back({.is_revisit = query.is_revisit,
                             .has_match = answered != Answered::kNot,
                             .is_right = answered == Answered::kRight && query.is_revisit,
                             .score = 1.0 / (1.0 + static_cast<double>(i * 7919 % 1000))});
    const std::size_t place =
        answered == Answered::kRight ? i : (i * 37 + 101) % report->places.size();
    result.matched_m.push_back(report->places[place].position);
    if (query.is_revisit) result.first_right.push_back(result.scored.back().is_right ? 1 : 0);
  }
  result.precision_recall = eval::MeasurePrecisionRecall(result.scored);
  const std::vector<eval::OperatingPoint>& points = result.precision_recall.points;
  result.divergences.assign(points.size(), 1.75);
  for (auto& divergences : result.kind_divergences) divergences.assign(points.size(), 0.25);
  if (name == "sure") result.reliability = eval::MeasureReliability(result.scored, 10);
  result.yaw_deg = eval::ErrorSummary{.median = 1.125, .mean = 1.25, .p90 = 2.5};
  report->results.push_back(std::move(result));
}

/// The figure of the title.
std::string FigureOf(const std::string& page, const std::string& title) {
  const std::size_t begin = page.find(absl::StrCat("<b>", title, "</b>"));
  if (begin == std::string::npos) return "";
  return page.substr(begin, page.find("</figure>", begin) - begin);
}

/// Lines drawn in the colour of wrong matches, the one in the legend not counted.
int CountWrongLines(const std::string& figure) {
  int count = -1;
  for (std::size_t at = 0; (at = figure.find("<path d=\"", at)) != std::string::npos; ++at) {
    const std::string path = figure.substr(at, figure.find("/>", at) - at);
    // Marks are drawn by relative moves.
    const bool is_of_lines = Count(path.substr(0, path.find("\" fill")), "m") == 0;
    if (is_of_lines && Count(path, "stroke=\"#d55e00\"") > 0) count += Count(path, "M");
  }
  return count;
}

void ExpectSelfContained(const std::string& page) {
  EXPECT_EQ(Count(page, "https://"), 0);
  EXPECT_EQ(Count(page, "http://"), Count(page, "=\"http://www.w3.org/2000/svg\""));
  for (const char* foreign : {"src=", "<script", "@import", "<link", "<image", "file:", "url("}) {
    EXPECT_EQ(Count(page, foreign), 0) << foreign;
  }
  EXPECT_EQ(Count(page, "</html>"), 1);
  std::set<std::string> ids;
  for (std::size_t at = 0; (at = page.find(" id=", at)) != std::string::npos; at += 4) {
    const std::size_t begin = at + 5;
    const std::string id = page.substr(begin, page.find(page[at + 4], begin) - begin);
    EXPECT_TRUE(ids.insert(id).second) << id << " is there twice";
  }
}

TEST(EvalPage, HoldsEveryChartAndNeedsNothingElse) {
  EvalReport report = MakeReport(240);
  AddResult(
      "sure", [](std::size_t) { return Answered::kRight; }, &report);
  AddResult(
      "a-pc:10", [](std::size_t i) { return i % 3 == 1 ? Answered::kWrong : Answered::kRight; },
      &report);
  const std::string page = EvalAsHtml(report);
  ExpectSelfContained(page);
  for (const char* title :
       {"Precision over recall", "F1 over recall", "Divergence over recall (DR)",
        "Divergence over recall (DR), easy revisits",
        "Divergence over recall (DR), lateral revisits",
        "Divergence over recall (DR), rotational revisits",
        "Divergence over recall (DR), lateral and rotational revisits",
        "Reliability of the confidence, sure", "Distribution of the revisits",
        "Matches of sure from above, at its greatest F1",
        "Matches of sure over time, at its greatest F1",
        "Matches of sure over time, at 100 % precision",
        "Matches of a-pc:10 from above, at its greatest F1",
        "Matches of a-pc:10 over time, at its greatest F1",
        "Matches of a-pc:10 over time, at 100 % precision"}) {
    EXPECT_EQ(Count(FigureOf(page, title), "</svg>"), 1) << title;
  }
  for (const char* label :
       {"recall (share of all revisits)", "KL divergence from all revisits [nats]",
        "distance to the nearest place [m]", "difference in heading [deg]", "x [m]", "y [m]",
        "time since the first query [s]", "1.125"}) {
    EXPECT_GT(Count(page, label), 0) << label;
  }
  EXPECT_LT(page.size(), 500'000);
}

TEST(EvalPage, ScalesDivergencesByTheData) {
  EvalReport report = MakeReport(40);
  AddResult(
      "pc", [](std::size_t) { return Answered::kRight; }, &report);
  const std::string page = EvalAsHtml(report);
  EXPECT_GT(Count(FigureOf(page, "Divergence over recall (DR)"), ">1.5<"), 0);
  EXPECT_EQ(Count(FigureOf(page, "Divergence over recall (DR), easy revisits"), ">1.5<"), 0);
}

TEST(EvalPage, DrawsNoFigureOfAKindTwice) {
  EvalReport report = MakeReport(40);
  for (eval::EvalQuery& query : report.queries) query.variance = {.translation_m = 1.0};
  AddResult(
      "pc", [](std::size_t) { return Answered::kRight; }, &report);
  EXPECT_EQ(Count(EvalAsHtml(report), "Divergence over recall (DR), easy revisits"), 0);
}

TEST(EvalPage, DrawsAllWrongMatchesEachByItself) {
  EvalReport report = MakeReport(1600);
  // One right answer makes accepting the others worth while.
  AddResult(
      "pc", [](std::size_t i) { return i % 2 == 0 ? Answered::kRight : Answered::kWrong; },
      &report);
  eval::PrecisionRecall& curve = report.results[0].precision_recall;
  curve.best = curve.points.size() - 1;  // all
  const std::string page = EvalAsHtml(report);
  int num_wrong = 0;
  int num_right = 0;
  for (std::size_t i = 0; i < report.queries.size(); ++i) {
    if (!report.queries[i].T_map_true) continue;
    ++(report.results[0].scored[i].is_right ? num_right : num_wrong);
  }
  ASSERT_EQ(num_wrong, 400);
  const std::string from_above = FigureOf(page, "Matches of pc from above, at its greatest F1");
  const std::string over_time = FigureOf(page, "Matches of pc over time, at its greatest F1");
  EXPECT_EQ(CountWrongLines(from_above), num_wrong);
  EXPECT_EQ(CountWrongLines(over_time), num_wrong);
  // Those of queries from elsewhere are counted only.
  EXPECT_NE(over_time.find(absl::StrCat(num_right, " right, 800 wrong (400 of them")),
            std::string::npos)
      << over_time.substr(0, 200);
  EXPECT_NE(over_time.find("One right match in 4 is drawn."), std::string::npos);
}

TEST(EvalPage, AcceptsNothingWhereNothingIsRight) {
  EvalReport report = MakeReport(40);
  AddResult(
      "pc", [](std::size_t) { return Answered::kWrong; }, &report);
  ASSERT_EQ(report.results[0].precision_recall.f1_max, 0.0);
  const std::string page = EvalAsHtml(report);
  for (const char* title : {"Matches of pc over time, at its greatest F1",
                            "Matches of pc over time, at 100 % precision"}) {
    const std::string figure = FigureOf(page, title);
    EXPECT_NE(figure.find("No match is accepted."), std::string::npos) << title;
    EXPECT_EQ(Count(figure, "#d55e00"), 0) << title;
  }
  EXPECT_NE(FigureOf(page, "Matches of pc from above, at its greatest F1")
                .find("0 right, 0 wrong, 30 revisits missed"),
            std::string::npos);
}

TEST(EvalPage, WithinASessionJoinsMatchesToThePathAtTheirTime) {
  EvalReport report = MakeReport(80);
  for (eval::EvalQuery& query : report.queries) query.sees_until_ns = query.stamp_ns;
  AddResult(
      "pc", [](std::size_t) { return Answered::kWrong; }, &report);
  AddResult(
      "cc", [](std::size_t) { return Answered::kRight; }, &report);
  const std::string page = EvalAsHtml(report);
  const std::string figure = FigureOf(page, "Matches of cc over time, at its greatest F1");
  EXPECT_EQ(Count(figure, ">drive</text>"), 1);
  EXPECT_EQ(Count(figure, ">map</text>"), 0);
}

TEST(EvalPage, StandsWithLittle) {
  for (const std::size_t num_queries : {0, 1, 2, 30}) {
    EvalReport report = MakeReport(num_queries);
    ExpectSelfContained(EvalAsHtml(report));  // no method
    AddResult(
        "sure", [](std::size_t) { return Answered::kRight; }, &report);
    AddResult(
        "none", [](std::size_t) { return Answered::kNot; }, &report);
    ExpectSelfContained(EvalAsHtml(report));
    // No revisit, and no position known.
    EvalReport elsewhere = MakeReport(num_queries);
    for (eval::EvalQuery& query : elsewhere.queries) query = {.name = query.name};
    AddResult(
        "sure", [](std::size_t) { return Answered::kWrong; }, &elsewhere);
    for (auto& divergences : elsewhere.results[0].kind_divergences) divergences.clear();
    const std::string page = EvalAsHtml(elsewhere);
    ExpectSelfContained(page);
    EXPECT_EQ(Count(page, "easy revisits"), 0);
    elsewhere.places.clear();
    ExpectSelfContained(EvalAsHtml(elsewhere));
  }
}

TEST(EvalPage, StandsFarFromTheOrigin) {
  EvalReport report = MakeReport(40);
  const Eigen::Vector2d far_m(4.1e5, -5.3e6);
  for (PicturedPlace& place : report.places) place.position += far_m;
  for (eval::EvalQuery& query : report.queries) {
    if (query.T_map_true) query.T_map_true->translation().head<2>() += far_m;
  }
  AddResult(
      "pc", [](std::size_t) { return Answered::kRight; }, &report);
  const std::string page = EvalAsHtml(report);
  ExpectSelfContained(page);
  EXPECT_NE(page.find("Positions from (410000, -5300000) m of the map frame."), std::string::npos);
}

TEST(EvalPage, NamesAreTextWhateverIsInThem) {
  EvalReport report = MakeReport(40);
  report.map = "<i>it's \"a\" & b</i>";
  const std::string name = "a\" onload=\"alert(1)\" x=\"" + std::string(40, 'x');
  AddResult(
      name, [](std::size_t) { return Answered::kRight; }, &report);
  AddResult(
      "<script>alert('it')</script>&%s{/Symbol}\\ which goes on",
      [](std::size_t) { return Answered::kRight; }, &report);
  const std::string page = EvalAsHtml(report);
  ExpectSelfContained(page);
  EXPECT_EQ(Count(page, "<i>"), 0);
  EXPECT_GT(Count(page, "&lt;i&gt;it's &quot;a&quot; &amp; b&lt;/i&gt;"), 0);
  EXPECT_GT(Count(page, "&lt;script&gt;alert('it')"), 0);
  EXPECT_GT(Count(page, "...</text>"), 0) << "they are cut in the legend";
}

TEST(EvalPage, StaysLightWithManyQueries) {
  EvalReport report = MakeReport(4000);
  for (const char* name : {"auto", "a-pc", "a-cc", "pc", "cc"}) {
    AddResult(
        name, [](std::size_t i) { return i % 10 == 1 ? Answered::kWrong : Answered::kRight; },
        &report);
  }
  EXPECT_LT(EvalAsHtml(report).size(), 1'000'000);
}

}  // namespace
}  // namespace scanloc::report
