#include "scanloc/server/fair_queue.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

namespace scanloc::server {
namespace {

FairQueue::Task Nothing() {
  return [](const absl::StatusOr<int>&) {};
}

/// Whose turn it is, one after the other, if each of a client's tasks lasts as long as here.
std::vector<std::string> Turns(FairQueue& line, std::size_t count,
                               const std::map<std::string, double>& seconds) {
  std::vector<std::string> turns;
  for (std::size_t i = 0; i < count && line.size() > 0; ++i) {
    turns.push_back(line.TakeNext(0.01).client);
    line.Correct(turns.back(), seconds.at(turns.back()) - 0.01);
  }
  return turns;
}

void Add(FairQueue& line, const std::string& client, int count) {
  for (int i = 0; i < count; ++i) line.Add({client, Nothing()});
}

TEST(FairQueue, GivesAlikeClientsTurnsAsTheyCame) {
  FairQueue line;
  Add(line, "b", 3);
  Add(line, "a", 1);
  Add(line, "c", 2);
  EXPECT_EQ(line.size(), 6);
  EXPECT_EQ(Turns(line, 6, {{"a", 1.0}, {"b", 1.0}, {"c", 1.0}}),
            (std::vector<std::string>{"b", "a", "c", "b", "c", "b"}));
  EXPECT_EQ(line.size(), 0);
}

TEST(FairQueue, SharesTimeNotTurns) {
  FairQueue line;
  Add(line, "long", 100);
  Add(line, "short", 100);
  const std::vector<std::string> turns =
      Turns(line, 105, {{"long", 0.25}, {"short", 0.0125}});  // 20 times as long
  EXPECT_EQ(std::count(turns.begin(), turns.end(), "long"), 5);
  EXPECT_EQ(turns[1], "short") << "waits for one long task, not more";
}

TEST(FairQueue, ChargesWhatIsExpectedWhileATaskRuns) {
  FairQueue line;
  Add(line, "a", 3);
  Add(line, "b", 1);
  EXPECT_EQ(line.TakeNext(0.01).client, "a");
  EXPECT_EQ(line.TakeNext(0.01).client, "b");
  // Both run. The next of a is charged on top of the first.
  EXPECT_EQ(line.TakeNext(0.01).client, "a");
  Add(line, "b", 1);
  EXPECT_EQ(line.TakeNext(0.01).client, "b");
}

TEST(FairQueue, LetsNobodySaveUpTime) {
  FairQueue line;
  Add(line, "steady", 50);
  (void)Turns(line, 40, {{"steady", 1.0}});
  Add(line, "late", 50);
  EXPECT_EQ(Turns(line, 6, {{"steady", 1.0}, {"late", 1.0}}),
            (std::vector<std::string>{"late", "steady", "late", "steady", "late", "steady"}));
}

TEST(FairQueue, RemembersWhoComesBackAtOnce) {
  FairQueue line;
  Add(line, "others", 10);
  // One task at a time, each a long one.
  Add(line, "long", 1);
  EXPECT_EQ(Turns(line, 2, {{"others", 0.1}, {"long", 0.45}}),
            (std::vector<std::string>{"others", "long"}));
  Add(line, "long", 1);
  EXPECT_EQ(Turns(line, 5, {{"others", 0.1}, {"long", 0.45}}),
            (std::vector<std::string>{"others", "others", "others", "others", "long"}));
}

TEST(FairQueue, TakesTheLastOfWhoHasMost) {
  FairQueue line;
  std::string called;
  for (const char* task : {"a1", "a2", "a3"}) {
    line.Add({"a", [&called, task](const absl::StatusOr<int>&) { called = task; }});
  }
  Add(line, "b", 2);
  EXPECT_FALSE(line.HasToSpareFor("b"));
  EXPECT_EQ(line.TakeLastFor("b"), nullptr);
  ASSERT_TRUE(line.HasToSpareFor("c"));
  line.TakeLastFor("c")(0);
  EXPECT_EQ(called, "a3");
  EXPECT_EQ(line.size(), 4);
}

TEST(FairQueue, StaysBoundedAmongClientsThatComeOnce) {
  FairQueue line;
  for (int i = 0; i < 20'000; ++i) {
    const std::string client = std::to_string(i);
    line.Add({client, Nothing()});
    EXPECT_EQ(line.TakeNext(0.01).client, client);
  }
  EXPECT_LE(line.num_remembered(), 4096U);
}

}  // namespace
}  // namespace scanloc::server
