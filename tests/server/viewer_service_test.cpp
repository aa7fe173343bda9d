// What people look at: places, pairs that look alike, and what was answered.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "ops/recent_answers.hpp"
#include "scanloc/client/client.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "support/same_answer.hpp"
#include "support/small_map.hpp"
#include "support/temp_dir.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

using ::testing::ElementsAre;

constexpr int kNumPlaces = 8;
constexpr char kQuery[] = "a-token-that-may-query-1";
constexpr char kView[] = "a-token-that-may-look-02";

class ViewerTest : public testing::Test {
 protected:
  ViewerTest() {
    Map map = test::SmallMap(1, kNumPlaces);
    map.confusable = {{.place = 2, .lookalike = 5, .confidence = 0.75}};
    maps_ = {{"town", map}, {"other", test::SmallMap(2, kNumPlaces)}};
  }

  void Start(int recent_answers, const std::string& tokens = "") {
    ServerOptions options = test::OptionsFor(maps_);
    options.recent_answers = recent_answers;
    if (!tokens.empty()) options.token_file = dir_.Write("tokens", tokens);
    server_ = test::StartServer(maps_, options);
  }

  [[nodiscard]] client::Client As(const std::string& token = "") const {
    return client::Client::Connect({.address = server_->address(), .token = token}).value();
  }

  test::TempDir dir_;
  test::Maps maps_;
  std::unique_ptr<Server> server_;
};

TEST_F(ViewerTest, TellsWhatTheMapHoldsOfAPlace) {
  Start(0);
  const auto place = As().GetPlace("town", 3);
  ASSERT_TRUE(place.ok()) << place.status();
  auto describer = Describer::Create(maps_["town"].params).value();
  ScanDescriptor expected = describer.Describe(test::PlaceScan(1, 3));
  expected.num_voxels = 0;
  EXPECT_EQ(place->descriptor, expected);
  EXPECT_EQ(place->place.session, 1);
  for (const int none : {-1, kNumPlaces}) {
    EXPECT_EQ(As().GetPlace("town", none).status().code(), absl::StatusCode::kNotFound);
  }
  EXPECT_EQ(As().GetPlace("nowhere", 0).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(ViewerTest, TellsWhichPlacesLookAlike) {
  Start(0);
  const auto pairs = As().ListConfusablePairs("town");
  ASSERT_TRUE(pairs.ok()) << pairs.status();
  EXPECT_THAT(pairs->pairs, ElementsAre(maps_["town"].confusable.front()));
}

TEST_F(ViewerTest, ShowsAnswersWithRivalsThatWereNotAskedFor) {
  Start(10);
  const client::Client robot = As();
  const auto told =
      robot.LocalizeScan(test::QueryScan(1, 2), {.map = "town", .request_id = "the-robot-s-own"});
  ASSERT_TRUE(told.ok()) << told.status();
  EXPECT_EQ(told->answer.candidates.size(), 1U);
  ASSERT_TRUE(robot.LocalizeScan(test::QueryScan(2, 0), {.map = "other"}).ok());

  const auto page = robot.ListAnswers("town");
  ASSERT_TRUE(page.ok()) << page.status();
  ASSERT_EQ(page->answers.size(), 1U);
  const SeenAnswer& seen = page->answers.front();
  EXPECT_EQ(seen.number, 1U);
  EXPECT_EQ(seen.request_id, "the-robot-s-own");
  EXPECT_GT(seen.answered_ns, 0);
  EXPECT_GT(seen.reply.answer.candidates.size(), 1U);
  EXPECT_FALSE(seen.structure.posts.empty());
  Answer best = seen.reply.answer;
  best.candidates.resize(1);
  test::ExpectSameAnswer(best, told->answer);
  EXPECT_TRUE(robot.ListAnswers("town", *page)->answers.empty());
  EXPECT_EQ(robot.ListAnswers("")->answers.size(), 2U);
}

TEST_F(ViewerTest, KeepsNoAnswersUnlessToldTo) {
  Start(0);
  EXPECT_EQ(As().ListAnswers("").status().code(), absl::StatusCode::kUnimplemented);
}

TEST_F(ViewerTest, ShowsWhatOthersAreToldOnlyToWhoMayLook) {
  Start(10, std::string("robot query ") + kQuery + "\nscreen view " + kView + "\n");
  ASSERT_TRUE(As(kQuery).LocalizeScan(test::QueryScan(1, 2), {.map = "town"}).ok());
  EXPECT_EQ(As(kQuery).ListAnswers("").status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(As().ListAnswers("").status().code(), absl::StatusCode::kUnauthenticated);
  const auto seen = As(kView).ListAnswers("");
  ASSERT_TRUE(seen.ok()) << seen.status();
  EXPECT_EQ(seen->answers.front().client, "token:robot");
  EXPECT_TRUE(As(kView).LocalizeScan(test::QueryScan(1, 2), {.map = "town"}).ok());
}

SeenAnswer AnswerOf(const std::string& map) {
  SeenAnswer answer;
  answer.reply.map = map;
  return answer;
}

std::vector<std::uint64_t> NumbersOf(const v1::ListAnswersResponse& response) {
  std::vector<std::uint64_t> numbers;
  for (const v1::SeenAnswer& answer : response.answers()) numbers.push_back(answer.number());
  return numbers;
}

TEST(RecentAnswers, KeepsTheNewestAndCountsTheOthers) {
  RecentAnswers answers(3);
  for (int i = 0; i < 5; ++i) answers.Add(AnswerOf(i % 2 == 0 ? "even" : "odd"));
  v1::ListAnswersRequest request;
  EXPECT_THAT(NumbersOf(*answers.List(request)), ElementsAre(3, 4, 5));
  request.set_map("odd");
  const auto odd = answers.List(request);
  EXPECT_THAT(NumbersOf(*odd), ElementsAre(4));
  EXPECT_EQ(odd->next_after(), 5U);
  request.Clear();
  request.set_max_answers(2);
  const auto first = answers.List(request);
  EXPECT_THAT(NumbersOf(*first), ElementsAre(3, 4));
  request.set_run(first->run());
  request.set_after(first->next_after());
  EXPECT_THAT(NumbersOf(*answers.List(request)), ElementsAre(5));
  request.set_run("of another start");
  EXPECT_THAT(NumbersOf(*answers.List(request)), ElementsAre(3, 4));
}

TEST(RecentAnswers, TakesNumbersFromOutOfRangeAndRefusesSizes) {
  RecentAnswers answers(3);
  answers.Add(AnswerOf("town"));
  v1::ListAnswersRequest request;
  request.set_run(answers.List(request)->run());
  request.set_after(~std::uint64_t{0});
  const auto page = answers.List(request);
  EXPECT_EQ(page->answers_size(), 0);
  EXPECT_EQ(page->next_after(), 1U);
  for (const int size : {-1, kMaxAnswersPerPage + 1}) {
    request.set_max_answers(size);
    EXPECT_EQ(answers.List(request).status().code(), absl::StatusCode::kInvalidArgument);
  }
}

TEST(RecentAnswers, ThinsScansOfMuchStructure) {
  RecentAnswers answers(1);
  SeenAnswer answer = AnswerOf("town");
  answer.structure.posts.resize(Structure::kMaxPosts);
  answer.reply.answer.candidates.resize(50);
  answers.Add(answer);
  const auto page = answers.List({});
  EXPECT_LE(page->answers(0).structure().posts_i16le().size(), kMaxSeenPosts * 4);
  EXPECT_EQ(page->answers(0).answer().candidates_size(), kMaxSeenCandidates);
}

TEST(RecentAnswers, ServesThreadsAtOnce) {
  RecentAnswers answers(10);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&answers] {
      for (int i = 0; i < 200; ++i) {
        answers.Add(AnswerOf("town"));
        EXPECT_LE(answers.List({})->answers_size(), 10);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(answers.List({})->next_after(), 800U);
}

}  // namespace
}  // namespace scanloc::server
