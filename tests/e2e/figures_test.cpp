// Answers drawn, measured and compared: plot, eval, report-diff.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "e2e/programs.hpp"
#include "support/scan_files.hpp"

namespace scanloc::test {
namespace {

using nlohmann::json;

TEST(Figures, PlotDrawsEveryAnswer) {
  const TempDir dir;
  MustScanloc({"locate", Town().map1, "--scans", Town().drive2, "--min-confidence", "0", "--csv",
               dir.File("answers.csv"), "--quiet"});
  const auto circles = [](const std::string& svg, const std::string& color) {
    int count = 0;
    for (std::size_t at = 0; (at = svg.find("fill=\"" + color + "\"", at)) != std::string::npos;) {
      ++count;
      ++at;
    }
    return count;
  };
  const std::string unchecked =
      MustScanloc({"plot", Town().map1, "--answers", dir.File("answers.csv"), "--out", "-"});
  EXPECT_EQ(circles(unchecked, "#56b4e9"), TinyTown::kNumScans + 1) << "and one in the legend";
  MustScanloc({"plot", Town().map1, "--answers", dir.File("answers.csv"), "--truth",
               Town().Poses2(), "--within-m", "1000", "--out", dir.File("answers.svg")});
  const std::string checked = ReadFile(dir.File("answers.svg"));
  EXPECT_EQ(circles(checked, "#0072b2"), TinyTown::kNumScans + 1);
  EXPECT_EQ(checked.substr(checked.size() - 7), "</svg>\n");
  const std::string alone = MustScanloc({"plot", Town().map1, "--out", "-"});
  EXPECT_NE(alone.find("map: 30 places"), std::string::npos) << "a map needs no answers";
}

TEST(Figures, ReportsGoIntoPapersAndAreCompared) {
  const TempDir dir;
  const auto report = [&](const std::string& folder, const Args& more) {
    Args args = {"eval",          Town().map1, "--scans",        Town().drive2, "--poses",
                 Town().Poses2(), "--report",  dir.File(folder), "--quiet"};
    args.insert(args.end(), more.begin(), more.end());
    MustScanloc(args);
  };
  report("a", {"--method", "auto"});
  EXPECT_NE(ReadFile(dir.File("a/figures/precision-over-recall.svg")).find("</svg>"),
            std::string::npos);
  EXPECT_EQ(ReadFile(dir.File("a/figures/precision-over-recall.pdf")).rfind("%PDF-", 0), 0U);
  EXPECT_EQ(ReadFile(dir.File("a/figures/precision-over-recall.csv")).rfind("series,part,", 0), 0U);
  for (const auto& entry : std::filesystem::directory_iterator(dir.File("a/figures"))) {
    const std::filesystem::path front = entry.path().parent_path() / entry.path().stem();
    if (front.filename() == "curves") continue;
    for (const char* of : {".svg", ".pdf", ".csv"}) {
      EXPECT_GT(std::filesystem::file_size(front.string() + of), 20U) << front << of;
    }
  }
  EXPECT_NE(ReadFile(dir.File("a/tables.tex")).find("\\begin{tabular}"), std::string::npos);
  EXPECT_EQ(ReadFile(dir.File("a/figures/curves.csv")).rfind("method,within_m", 0), 0U);
  EXPECT_NE(ReadFile(dir.File("a/report.html")).find("Made by scanloc"), std::string::npos);
  EXPECT_NE(ReadFile(dir.File("a/results.json")).find("\"command\": \""), std::string::npos);
  report("b", {"--method", "auto"});
  const std::string same = MustScanloc({"report-diff", dir.File("a"), dir.File("b")});
  EXPECT_NE(same.find("better:\n  none\nworse:\n  none\n"), std::string::npos) << same;
  std::string matches = ReadFile(dir.File("b/matches.csv"));
  const std::size_t at = matches.find(",localized,1,");
  ASSERT_NE(at, std::string::npos) << matches;
  dir.Write("b/matches.csv", matches.replace(at, 13, ",localized,0,"));
  const std::string worse = MustScanloc({"report-diff", dir.File("a"), dir.File("b")});
  EXPECT_NE(worse.find("found -> FALSE"), std::string::npos) << worse;
  EXPECT_EQ(Scanloc({"report-diff", dir.File("a"), dir.File("none")}).status, 1);
}

TEST(Figures, EvalMeasuresEveryMethodAndWritesAReport) {
  const TempDir dir;
  const Args args = {"eval",          Town().map1, "--scans",          Town().drive2, "--poses",
                     Town().Poses2(), "--report",  dir.File("report"), "--json",      "--quiet"};
  const json document = json::parse(MustScanloc(args));
  EXPECT_EQ(document.at("content_id"), ContentId(Town().map1));
  EXPECT_EQ(document.at("num_queries"), TinyTown::kNumScans);
  EXPECT_EQ(document.at("num_revisits"), TinyTown::kNumScans);
  ASSERT_EQ(document.at("results").size(), 5);
  const json& best = document.at("results")[0];
  EXPECT_EQ(best.at("method"), "auto");
  EXPECT_EQ(best.at("recall_at_1"), 1.0);
  EXPECT_EQ(best.at("f1_max"), 1.0);
  EXPECT_LT(best.at("expected_calibration_error"), 0.1);
  EXPECT_LT(best.at("median_position_error_m"), 0.5);
  EXPECT_EQ(best.at("kinds").at("easy").at("num_revisits"), TinyTown::kNumScans);
  EXPECT_TRUE(document.at("results")[1].at("expected_calibration_error").is_null());
  json in_folder = json::parse(ReadFile(dir.path() / "report" / "results.json"));
  EXPECT_EQ(in_folder.erase("made"), 1U);
  EXPECT_EQ(in_folder, document);
  const std::string html = ReadFile(dir.path() / "report" / "report.html");
  EXPECT_NE(html.find("<svg"), std::string::npos);
  EXPECT_EQ(CountLines(ReadFile(dir.path() / "report" / "matches.csv")),
            1 + 5 * TinyTown::kNumScans);
}

TEST(Figures, EvalCountsScansOfElsewhereAsNoRevisits) {
  const json document = json::parse(MustScanloc(
      {"eval", Town().map1, "--scans", Town().drive2, "--poses", Town().Poses2(), "--negatives",
       Town().drive1, "--method", "a-pc:5,auto", "--threads", "1", "--json", "--quiet"}));
  EXPECT_EQ(document.at("num_elsewhere"), TinyTown::kNumScans);
  ASSERT_EQ(document.at("results").size(), 2);
  EXPECT_EQ(document.at("results")[0].at("method"), "a-pc:5");
  // They are the mapped scans themselves: taken for right by the method, wrong by definition.
  EXPECT_LT(document.at("results")[0].at("f1_max"), 0.8);
}

TEST(Figures, EvalRefusesWhatItCannotMeasure) {
  for (const Args& wrong : {Args{"--method", "a-pc:0"}, Args{"--method", "orb"}}) {
    Args args = {"eval", Town().map1, "--scans", Town().drive2, "--poses", Town().Poses2()};
    args.insert(args.end(), wrong.begin(), wrong.end());
    EXPECT_EQ(Scanloc(args).status, 2);
  }
  const ProcessResult missing = Scanloc({"eval", Town().map1, "--scans", Town().drive2, "--poses",
                                         Town().Poses2(), "--negatives", "nowhere", "--quiet"});
  EXPECT_EQ(missing.status, 1);
  EXPECT_EQ(CountLines(missing.err), 1) << missing.err;
}

TEST(Figures, EvalWarnsOfScansThatFindThemselves) {
  const Args own = {"eval",          Town().map1, "--scans", Town().drive1, "--poses",
                    Town().Poses1(), "--method",  "a-pc",    "--quiet"};
  const ProcessResult warned = Scanloc(own);
  EXPECT_EQ(warned.status, 0);
  EXPECT_NE(warned.err.find("--in-session"), std::string::npos) << warned.err;
  Args other = own;
  other[3] = Town().drive2;
  other[5] = Town().Poses2();
  EXPECT_EQ(Scanloc(other).err, "");
}

TEST(Figures, EvalComparesWithKeysAloneAndSeveralTrees) {
  const json document = json::parse(
      MustScanloc({"eval", Town().map1, "--scans", Town().drive2, "--poses", Town().Poses2(),
                   "--method", "a-pc,a-pc-key,a-cc-key,a-pc-trees:2", "--json", "--quiet"}));
  for (const json& result : document.at("results")) {
    EXPECT_GT(result.at("recall_at_1"), 0.5) << result.at("method");
    EXPECT_GT(result.at("times_ms").at("describe"), 0.0);
  }
  EXPECT_TRUE(document.at("results")[0].at("recall_at_5").is_null());
  EXPECT_TRUE(document.at("results")[1].at("recall_at_10").is_number());
}

TEST(Figures, EvalComparesWithABaselineOfTheSameScans) {
  const Args common = {"eval",    Town().map1,     "--scans",  Town().drive2,
                       "--poses", Town().Poses2(), "--method", "auto,m2dp"};
  Args args = common;
  args.insert(args.end(), {"--map-scans", Town().drive1, "--map-poses", Town().Poses1(), "--json",
                           "--quiet", "--within-m", "8,2", "--query-tilt-deg", "2"});
  const json document = json::parse(MustScanloc(args));
  ASSERT_EQ(document.at("results").size(), 4);
  const json& baseline = document.at("results")[1];
  EXPECT_EQ(baseline.at("method"), "m2dp");
  EXPECT_TRUE(baseline.at("yaw_error_deg").is_null());
  EXPECT_GT(baseline.at("recall_at_10"), 0.5);
  EXPECT_GT(baseline.at("times_ms").at("describe"), 0.0);
  EXPECT_EQ(document.at("results")[0].at("recall_at_1"), 1.0);
  EXPECT_LT(document.at("results")[0].at("yaw_error_deg").at("p90"), 1.0);
  EXPECT_EQ(document.at("results")[2].at("within_m"), 2.0);
  EXPECT_LE(document.at("results")[3].at("recall_at_1"), baseline.at("recall_at_1"));

  const ProcessResult unknown = Scanloc(common);
  EXPECT_EQ(unknown.status, 1);
  EXPECT_NE(unknown.err.find("baseline"), std::string::npos) << unknown.err;
  Args other = common;
  other.insert(other.end(), {"--map-scans", Town().drive2, "--map-poses", Town().Poses2()});
  EXPECT_EQ(Scanloc(other).status, 1);
}

TEST(Figures, EvalJudgesDescriptorsThatWereComputedElsewhere) {
  const TempDir dir;
  const auto write = [&](const std::string& name, int num_rows, float first) {
    std::string values;
    for (int row = 0; row < num_rows; ++row) {
      AppendBytes(values, 1.0F);
      AppendBytes(values, first + static_cast<float>(row));
    }
    dir.Write(name, NpyBytes("{'descr': '<f4', 'fortran_order': False, 'shape': (" +
                                 std::to_string(num_rows) + ", 2), }",
                             values));
    return dir.File(name);
  };
  constexpr int kNum = TinyTown::kNumScans;
  const std::string of_map = write("map.npy", kNum, 0.1F);
  const auto ask = [&](const std::string& of_queries, const std::string& of_places,
                       const Args& more) {
    Args args = {"eval",
                 Town().map1,
                 "--scans",
                 Town().drive2,
                 "--poses",
                 Town().Poses2(),
                 "--method",
                 "a-pc",
                 "--json",
                 "--quiet",
                 "--descriptors-from",
                 of_queries,
                 "--map-descriptors-from",
                 of_places};
    args.insert(args.end(), more.begin(), more.end());
    return Scanloc(args);
  };
  const ProcessResult judged = ask(write("net.npy", kNum, 0.0F), of_map, {});
  ASSERT_EQ(judged.status, 0) << judged.err;
  const json document = json::parse(judged.out);
  ASSERT_EQ(document.at("results").size(), 2);
  EXPECT_EQ(document.at("results")[1].at("method"), "net");
  EXPECT_EQ(document.at("results")[1].at("recall_at_1"), 1.0);
  // Rows that are asked for are those of their scans, whichever are taken.
  const ProcessResult part = ask(dir.File("net.npy"), of_map, {"--from", "5"});
  EXPECT_EQ(json::parse(part.out).at("results")[1].at("recall_at_1"), 1.0);

  const struct {
    ProcessResult result;
    int status;
    std::string reason;
  } cases[] = {
      {ask(write("few.npy", kNum - 1, 0.0F), of_map, {}), 1, "29 rows; 30 are needed"},
      {ask(dir.File("net.npy"), write("most.npy", kNum + 1, 0.0F), {}), 1, "31 rows; 30 are"},
      {ask(write("a-pc.npy", kNum, 0.0F), of_map, {}), 1, "rename the file"},
      {ask(dir.File("none.npy"), of_map, {}), 1, "none.npy"},
      {ask(dir.File("net.npy"), of_map, {"--descriptors-from", of_map}), 2, "2 and 1"},
      {ask(dir.File("net.npy"), of_map, {"--query-tilt-deg", "2"}), 2, "--query-tilt-deg"},
      {ask(dir.File("net.npy"), of_map, {"--descriptor-distance", "l1"}), 2, "l1"},
  };
  for (const auto& [result, status, reason] : cases) {
    EXPECT_EQ(result.status, status) << reason;
    EXPECT_NE(result.err.find(reason), std::string::npos) << result.err;
  }
}

TEST(Figures, EvalWithinASessionSeesOnlyOlderPlaces) {
  const TempDir dir;
  const std::string times = Town().drive1 + "/times.txt";
  MustScanloc({"build", dir.File("own.scanloc"), "--scans", Town().drive1, "--poses",
               Town().Poses1(), "--times", times, "--spacing-m", "0", "--no-calibrate", "--quiet"});
  Args args = {"eval",           dir.File("own.scanloc"),
               "--scans",        Town().drive1,
               "--poses",        Town().Poses1(),
               "--times",        times,
               "--in-session",   "--method",
               "auto,a-pc,m2dp", "--json",
               "--quiet",        "--window-s"};
  // A drive that never comes back finds nothing, once its own surroundings are too young.
  args.push_back("10000");
  const json none = json::parse(MustScanloc(args));
  EXPECT_EQ(none.at("num_revisits"), 0);
  for (const json& result : none.at("results")) EXPECT_TRUE(result.at("curve").empty());
  // Without a window each but the first sees the place before.
  args.back() = "0";
  const json all = json::parse(MustScanloc(args));
  EXPECT_EQ(all.at("num_revisits"), TinyTown::kNumScans - 1);
  EXPECT_GT(all.at("results")[0].at("recall_at_1"), 0.9);

  Args without_times = args;
  without_times[1] = Town().map1;
  const ProcessResult refused = Scanloc(without_times);
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("--times"), std::string::npos) << refused.err;
}

}  // namespace
}  // namespace scanloc::test
