#include "admission/byte_budget.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace scanloc::server {
namespace {

/// Takes shares for the client until the budget says that it is overdrawn for it.
int NumTaken(ByteBudget& budget, const std::string& client, std::int64_t num_bytes,
             std::vector<ByteBudget::Share>& held) {
  for (int count = 0;; ++count) {
    ByteBudget::Share share(budget, client, num_bytes);
    if (budget.IsOverdrawnFor(client)) return count;
    held.push_back(std::move(share));
  }
}

TEST(ByteBudget, GivesOneClientHalfAtMost) {
  ByteBudget budget(100);
  std::vector<ByteBudget::Share> held;
  EXPECT_EQ(NumTaken(budget, "a", 10, held), 5);
  EXPECT_FALSE(budget.IsOverdrawnFor("b"));
  held.clear();
  EXPECT_TRUE(budget.IsEmpty());
  EXPECT_EQ(NumTaken(budget, "a", 10, held), 5);
}

TEST(ByteBudget, LeavesRoomForWhoComesAfterMany) {
  ByteBudget budget(100);
  std::vector<ByteBudget::Share> held;
  EXPECT_EQ(NumTaken(budget, "a", 5, held), 10);
  EXPECT_EQ(NumTaken(budget, "b", 5, held), 5);
  EXPECT_EQ(NumTaken(budget, "a", 5, held), 0);
  EXPECT_EQ(NumTaken(budget, "c", 5, held), 3);
  EXPECT_EQ(NumTaken(budget, "d", 5, held), 2);
  EXPECT_EQ(NumTaken(budget, "e", 5, held), 0) << "all of it is taken";
}

TEST(ByteBudget, TakesAnythingThatIsAlone) {
  ByteBudget budget(100);
  const ByteBudget::Share large(budget, "a", 1000);
  EXPECT_FALSE(budget.IsOverdrawnFor("a"));
  const ByteBudget::Share small(budget, "b", 1);
  EXPECT_TRUE(budget.IsOverdrawnFor("a"));
  EXPECT_TRUE(budget.IsOverdrawnFor("b"));
}

TEST(ByteBudget, CountsAShareOnceHoweverItIsMoved) {
  ByteBudget budget(100);
  ByteBudget::Share first(budget, "a", 40);
  ByteBudget::Share second = std::move(first);
  EXPECT_EQ(budget.BytesOf("a"), 40);
  second = ByteBudget::Share(budget, "b", 1);
  EXPECT_EQ(budget.BytesOf("a"), 0);
  EXPECT_EQ(budget.BytesOf("b"), 1);
  second = {};
  EXPECT_TRUE(budget.IsEmpty());
}

}  // namespace
}  // namespace scanloc::server
