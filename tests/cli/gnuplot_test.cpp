#include "cli/gnuplot.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "cli/chart.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::cli {
namespace {

using test::TempDir;

/// Sets a variable of the environment for one scope.
class ScopedVariable {
 public:
  ScopedVariable(const char* name, const std::string& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    setenv(name, value.c_str(), 1);
  }
  ScopedVariable(const ScopedVariable&) = delete;
  ScopedVariable& operator=(const ScopedVariable&) = delete;
  ~ScopedVariable() { before_.empty() ? unsetenv(name_) : setenv(name_, before_.c_str(), 1); }

 private:
  const char* name_;
  std::string before_;
};

constexpr const char* kDrawOne =
    "set terminal svg noenhanced\nset key noenhanced\nset output 'one.svg'\nplot [0:1] x title ";

TEST(Gnuplot, GivesTheFilesAndLeavesNothingBehind) {
  const TempDir dir;
  const ScopedVariable temporary("TMPDIR", dir.path().string());
  const auto output = RunGnuplot(absl::StrCat(kDrawOne, "'line'\n"), {"one.svg"});
  ASSERT_TRUE(output.ok()) << output.status();
  ASSERT_EQ(output->files.size(), 1);
  EXPECT_NE(output->files[0].find(">line</text>"), std::string::npos);
  EXPECT_EQ(output->warnings, "");
  EXPECT_TRUE(std::filesystem::is_empty(dir.path()));
}

TEST(Gnuplot, TellsWhatWentWrongInOneLine) {
  for (const char* script : {"plot nonsense(\n", "exit status 3\n", "set output 'one.svg'\n"}) {
    const absl::Status status = RunGnuplot(script, {"one.svg"}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInternal) << script;
    EXPECT_EQ(status.message().find('\n'), std::string::npos) << status;
    EXPECT_NE(status.message().find("gnuplot"), std::string::npos) << status;
  }
  EXPECT_NE(RunGnuplot("plot nonsense(\n", {}).status().message().find("charts.gp"),
            std::string::npos)
      << "its own words";
}

TEST(Gnuplot, IsMissedByName) {
  const TempDir dir;
  const ScopedVariable path("PATH", dir.path().string());
  const absl::Status status = RunGnuplot("", {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_NE(status.message().find("apt-get install gnuplot-nox"), std::string::npos) << status;
}

TEST(Gnuplot, NamesAreTextWhateverIsInThem) {
  const TempDir dir;
  const std::string trap = dir.File("trap");
  for (const std::string& name :
       {absl::StrCat("a\"; system(\"touch ", trap, "\"); \""),
        absl::StrCat("a'; system('touch ", trap, "'); '"), absl::StrCat("`touch ", trap, "`"),
        absl::StrCat("a'\nsystem('touch ", trap, "')\n'"), absl::StrCat("a\\\n! touch ", trap),
        absl::StrCat("a' ; ! touch ", trap, "\n#"), std::string("%s %d @a $1 {/Symbol a} _^ \\"),
        std::string("<script>&amp;\"'")}) {
    const auto output =
        RunGnuplot(absl::StrCat(kDrawOne, GnuplotQuoted(name), "\nunset output\n"), {"one.svg"});
    ASSERT_TRUE(output.ok()) << name << ": " << output.status();
    EXPECT_EQ(output->warnings, "");
    EXPECT_EQ(output->files[0].find("<script>"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(trap)) << name;
  }
}

TEST(Chart, DrawsEachChartAsOneElementAndNothingOutside) {
  ChartSheet sheet;
  ChartSeries line{.name = "it's <b>", .points = {{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}}};
  ChartSeries far{.name = "far",
                  .style = ChartSeries::Style::kSegments,
                  .points = {{0.0, 0.0, 0.0}, {0.5, 0.5, 0.5}}};
  EXPECT_EQ(sheet.Add(LineChart{.x = {"x"}, .y = {"y"}, .series = {line, far}}), 0);
  EXPECT_EQ(sheet.Add(LineChart{.x = {"x"}, .y = {"y"}, .series = {}}), 1) << "of nothing";
  EXPECT_EQ(
      sheet.Add(SpaceChart{.x = {"x"}, .y = {"y"}, .z = {"z", -1.0, 1.0}, .series = {line, far}}),
      2);
  EXPECT_EQ(sheet.Add(SpaceChart{.x = {"x"}, .y = {"y"}, .z = {"z"}, .series = {}}), 3);
  EXPECT_EQ(
      sheet.Add(HeatMap{.x = {"x"}, .y = {"y"}, .count_title = "n", .cells = {{0, 1}, {7, 0}}}), 4);
  EXPECT_EQ(sheet.Add(HeatMap{.x = {"x"}, .y = {"y"}, .count_title = "n", .cells = {{0}}}), 5);
  EXPECT_EQ(sheet.Add(BarChart{.x = {"x"},
                               .y = {"y"},
                               .count_title = "n",
                               .bars = {{0.0, 0.5, 3}, {0.5, 1.0, 0}},
                               .series = {line}}),
            6);
  const auto drawings = sheet.Draw();
  ASSERT_TRUE(drawings.ok()) << drawings.status();
  EXPECT_EQ(drawings->warnings, "");
  ASSERT_EQ(drawings->svgs.size(), 7);
  for (const std::string& svg : drawings->svgs) {
    EXPECT_EQ(svg.substr(0, 4), "<svg");
    EXPECT_EQ(svg.find("</svg>"), svg.rfind("</svg>"));
  }
  EXPECT_NE(drawings->svgs[0].find(">it's &lt;b></text>"), std::string::npos);
  EXPECT_NE(drawings->svgs[4].find(">7</text>"), std::string::npos) << "cells are numbered";
  EXPECT_NE(drawings->svgs[6].find(">3</text>"), std::string::npos) << "bars, too";
}

}  // namespace
}  // namespace scanloc::cli
