#include "scanloc/jobs/jobs.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <new>

#include "absl/strings/str_cat.h"
#include "scanloc/jobs/ordered_jobs.hpp"

namespace scanloc {
namespace {

TEST(RunJobs, DoesAllAndTellsTheFirstErrorInOrder) {
  std::vector<int> num_done(50, 0);
  std::size_t told = 0;
  EXPECT_TRUE(RunJobs(
                  3, num_done.size(),
                  [&](std::size_t number, std::size_t worker) {
                    EXPECT_LT(worker, 3U);
                    ++num_done[number];
                    return absl::OkStatus();
                  },
                  [&](std::size_t num) { told = num; })
                  .ok());
  EXPECT_EQ(num_done, std::vector<int>(50, 1));
  EXPECT_EQ(told, 50U);
  // However soon they are done.
  for (int round = 0; round < 200; ++round) {
    told = 0;
    EXPECT_TRUE(RunJobs(
                    3, 3, [](std::size_t, std::size_t) { return absl::OkStatus(); },
                    [&](std::size_t num) { told = num; })
                    .ok());
    ASSERT_EQ(told, 3U);
  }
  const absl::Status failed = RunJobs(
      1, 10,
      [](std::size_t number, std::size_t) {
        return number < 4 ? absl::OkStatus() : absl::NotFoundError(absl::StrCat("job ", number));
      },
      [](std::size_t) {});
  EXPECT_EQ(failed, absl::NotFoundError("job 4"));
}

TEST(RunJobs, TellsThatMemoryRanOut) {
  const absl::Status status = RunJobs(
      2, 10,
      [](std::size_t i, std::size_t) -> absl::Status {
        if (i == 3) throw std::bad_alloc();
        return absl::OkStatus();
      },
      [](std::size_t) {});
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
}

TEST(OrderedJobs, GiveResultsInOrderAndRunAheadByAWindow) {
  std::atomic<int> num_taken = 0;
  std::atomic<int> farthest = 0;
  OrderedJobs<int> jobs(5, 205, 4, [&](std::size_t number, std::size_t worker) {
    EXPECT_LT(worker, 3U);
    const int ahead = static_cast<int>(number) - 5 - num_taken;
    if (ahead > farthest) farthest = ahead;
    return static_cast<int>(number * number);
  });
  ASSERT_TRUE(jobs.Start(3).ok());
  for (int i = 5; i < 205; ++i) {
    ASSERT_EQ(jobs.Take(), i * i);
    ++num_taken;
  }
  EXPECT_LE(farthest, 4);  // the one that is just being taken, and a window from there
}

TEST(OrderedJobs, ThrowWhatAJobThrewWhereItIsTaken) {
  OrderedJobs<int> jobs(0, 10, 2, [](std::size_t number, std::size_t) {
    if (number == 1) throw std::bad_alloc();
    return static_cast<int>(number);
  });
  ASSERT_TRUE(jobs.Start(2).ok());
  EXPECT_EQ(jobs.Take(), 0);
  EXPECT_THROW((void)jobs.Take(), std::bad_alloc);
  EXPECT_EQ(jobs.Take(), 2);
}

TEST(OrderedJobs, EndWithoutHavingBeenTaken) {
  std::atomic<int> num_done = 0;
  {
    OrderedJobs<int> jobs(0, 1000, 8, [&](std::size_t, std::size_t) { return ++num_done; });
    ASSERT_TRUE(jobs.Start(2).ok());
    (void)jobs.Take();
  }
  EXPECT_LE(num_done, 9);
}

TEST(RunTasks, DoesEachOnce) {
  for (const std::size_t num_threads : {1U, 3U}) {
    std::vector<std::atomic<int>> num_done(7);
    std::vector<std::function<void()>> tasks;
    for (std::atomic<int>& num : num_done) tasks.emplace_back([&num] { ++num; });
    EXPECT_TRUE(RunTasks(num_threads, tasks).ok());
    for (const std::atomic<int>& num : num_done) EXPECT_EQ(num, 1);
  }
}

TEST(RunBoth, EndsOnceBothHave) {
  std::atomic<int> num_done = 0;
  RunBoth([&] { ++num_done; }, [&] { ++num_done; });
  EXPECT_EQ(num_done, 2);
  const auto fail = [] { throw std::bad_alloc(); };
  EXPECT_THROW(RunBoth(fail, [&] { ++num_done; }), std::bad_alloc);
  EXPECT_THROW(RunBoth([&] { ++num_done; }, fail), std::bad_alloc);
}

}  // namespace
}  // namespace scanloc
