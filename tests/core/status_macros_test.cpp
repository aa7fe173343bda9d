#include "scanloc/core/status_macros.hpp"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>

namespace scanloc {
namespace {

absl::StatusOr<std::unique_ptr<int>> Half(int number) {
  if (number % 2 != 0) return absl::InvalidArgumentError("odd");
  return std::make_unique<int>(number / 2);
}

absl::StatusOr<int> Quarter(int number) {
  ASSIGN_OR_RETURN(const std::unique_ptr<int> half, Half(number));
  std::unique_ptr<int> quarter;
  ASSIGN_OR_RETURN(quarter, Half(*half));
  return *quarter;
}

absl::StatusOr<std::string> CheckedQuarter(int number, int* num_checked) {
  RETURN_IF_ERROR(Quarter(number).status());
  ++*num_checked;
  ASSIGN_OR_RETURN(const auto only,
                   absl::StatusOr<std::map<int, int>>(std::map<int, int>{{number, 1}}));
  return std::string(only.size(), 'x');
}

TEST(AssignOrReturn, GivesTheValueToANewVariableAndToOneThatIsThere) {
  const absl::StatusOr<int> quarter = Quarter(12);
  ASSERT_TRUE(quarter.ok()) << quarter.status();
  EXPECT_EQ(*quarter, 3);
}

TEST(AssignOrReturn, EndsTheFunctionWithTheStatusAsItIs) {
  for (const int number : {5, 6}) {
    EXPECT_EQ(Quarter(number).status(), absl::InvalidArgumentError("odd")) << number;
  }
}

TEST(ReturnIfError, EndsTheFunctionOnlyWhereThereIsAnError) {
  int num_checked = 0;
  EXPECT_EQ(CheckedQuarter(6, &num_checked).status(), absl::InvalidArgumentError("odd"));
  EXPECT_EQ(num_checked, 0);
  EXPECT_EQ(CheckedQuarter(8, &num_checked).value(), "x");
  EXPECT_EQ(num_checked, 1);
}

}  // namespace
}  // namespace scanloc
