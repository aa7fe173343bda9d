#include "scanloc/report/csv.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace scanloc::report {
namespace {

TEST(CsvRow, QuotesOnlyWhatNeedsIt) {
  EXPECT_EQ(CsvRow({"plain", "", "a b"}), "plain,,a b\n");
  EXPECT_EQ(CsvRow({"a,b", "say \"x\""}), "\"a,b\",\"say \"\"x\"\"\"\n");
}

TEST(CsvRow, HasNoLineAndNoTerminalToItself) {
  EXPECT_EQ(CsvRow({"two\nlines", "\x1b[2J", "\u202e"}), "two\\nlines,\\x1b[2J,\\u202e\n");
}

TEST(CsvTable, ReadsBackWhatCsvRowWrote) {
  const std::vector<std::string> hard = {"a,b", "\"", "two lines", "", "ä"};
  const auto table = CsvTable::Parse(CsvRow({"1", "2", "3", "4", "5"}) + CsvRow(hard));
  ASSERT_TRUE(table.ok()) << table.status();
  ASSERT_EQ(table->num_rows(), 1U);
  for (std::size_t i = 0; i < hard.size(); ++i) {
    EXPECT_EQ(table->Text(0, std::to_string(i + 1)), hard[i]);
  }
}

TEST(CsvTable, TakesWhatSpreadsheetsWrite) {
  const auto table = CsvTable::Parse("\xEF\xBB\xBFname,x\r\none,1.5\r\n\r\n\"two\",\r\n\n");
  ASSERT_TRUE(table.ok()) << table.status();
  ASSERT_EQ(table->num_rows(), 2U);
  EXPECT_TRUE(table->HasColumn("name"));
  EXPECT_FALSE(table->HasColumn("y"));
  EXPECT_EQ(*table->Number(0, "x"), 1.5);
  EXPECT_EQ(table->Text(1, "name"), "two");
  EXPECT_EQ(*table->Number(1, "x"), std::nullopt);
}

TEST(CsvTable, TakesALastLineWithoutEnd) {
  const auto table = CsvTable::Parse("a,b\n1,2");
  ASSERT_TRUE(table.ok()) << table.status();
  EXPECT_EQ(table->Text(0, "b"), "2");
}

TEST(CsvTable, RefusesWhatIsNoTable) {
  for (const char* text : {"", "a,a\n", "a,b\n1\n", "a,b\n1,2,3\n", "a\n\"open\n", "a,b\n1,\"2"}) {
    const auto table = CsvTable::Parse(text);
    EXPECT_EQ(table.status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
  EXPECT_NE(CsvTable::Parse("a,b\n1,2\n\"x\ny\",2\n3\n").status().message().find("line 5"),
            std::string::npos);
}

TEST(CsvTable, RefusesNumbersThatAreNone) {
  const auto table = CsvTable::Parse("x\nnan\ninf\n1x\n 2 \n");
  ASSERT_TRUE(table.ok()) << table.status();
  for (const std::size_t row : {0, 1, 2}) {
    EXPECT_EQ(table->Number(row, "x").status().code(), absl::StatusCode::kInvalidArgument) << row;
  }
  EXPECT_EQ(*table->Number(3, "x"), 2.0);
}

TEST(CsvTable, WithstandsEveryTruncation) {
  const std::string text = "query,x\r\n\"a \"\"b\"\", c\",1.5\r\nplain,2\r\n";
  for (std::size_t length = 0; length <= text.size(); ++length) {
    const auto table = CsvTable::Parse(text.substr(0, length));
    if (table.ok()) {
      EXPECT_LE(table->num_rows(), 2U);
    }
  }
}

TEST(FixedText, GivesZeroNoSign) {
  EXPECT_EQ(FixedText(-1e-12, 3), "0.000");
  EXPECT_EQ(FixedText(-0.0, 0), "0");
  EXPECT_EQ(FixedText(-0.25, 3), "-0.250");
  EXPECT_EQ(FixedText(12.0, 1), "12.0");
}

TEST(AppendPoseFields, TellsOneOfBothQuaternions) {
  for (const double yaw_rad : {1.0, 3.0, -3.0, 1.0 + 2.0 * std::numbers::pi}) {
    std::vector<std::string> fields;
    AppendPoseFields(PlanarOffset(2.0, yaw_rad), &fields);
    ASSERT_EQ(fields.size(), 7U);
    EXPECT_EQ(fields[1], "2.000000000");
    EXPECT_NE(fields[6].front(), '-');
  }
}

}  // namespace
}  // namespace scanloc::report
