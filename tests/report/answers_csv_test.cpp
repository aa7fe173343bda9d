#include "scanloc/report/answers_csv.hpp"

#include <gtest/gtest.h>

#include "support/temp_dir.hpp"

namespace scanloc::report {
namespace {

TEST(ReadAnswersCsv, TellsWhatIsRightWhereTheCsvSaysWhatIsMissed) {
  const test::TempDir dir;
  const std::string path = dir.Write("answers.csv",
                                     "query,outcome,place,x,y,true_x,true_y,missed\n"
                                     "a.bin,localized,0,1,2,1,2,\n"
                                     "b.bin,localized,0,1,2,1,2,height+heading\n"
                                     "c.bin,insufficient_scan,,,,1,2,\n");
  const auto answers = ReadAnswersCsv(path);
  ASSERT_TRUE(answers.ok()) << answers.status();
  ASSERT_EQ(answers->size(), 3U);
  EXPECT_EQ((*answers)[0].is_right, true);
  EXPECT_EQ((*answers)[1].is_right, false);
  EXPECT_EQ((*answers)[2].is_right, std::nullopt);
}

TEST(ReadAnswersCsv, KnowsNothingOfRightWithoutTheColumn) {
  const test::TempDir dir;
  const std::string path = dir.Write("answers.csv",
                                     "query,outcome,place,x,y,true_x,true_y\n"
                                     "a.bin,localized,0,1,2,1,2\n");
  EXPECT_EQ(ReadAnswersCsv(path)->front().is_right, std::nullopt);
}

}  // namespace
}  // namespace scanloc::report
