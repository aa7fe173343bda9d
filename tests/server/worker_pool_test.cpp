#include "scanloc/server/worker_pool.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <set>
#include <vector>

#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

TEST(WorkerPool, RunsEveryTaskItTakes) {
  std::atomic<int> num_run = 0;
  {
    WorkerPool pool(4, 1000);
    for (int i = 0; i < 1000; ++i) {
      ASSERT_TRUE(pool.Submit([&](int) { ++num_run; }).ok());
    }
  }
  EXPECT_EQ(num_run, 1000);
}

TEST(WorkerPool, HasRunEveryTaskWhenItIsFinished) {
  std::atomic<int> num_run = 0;
  WorkerPool pool(4, 1000);
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(pool.Submit([&](int) { ++num_run; }).ok());
  }
  pool.Finish();
  EXPECT_EQ(num_run, 1000);
}

TEST(WorkerPool, RefusesTheTaskThatIsOneTooMany) {
  test::Gate gate;
  std::atomic<int> num_run = 0;
  {
    WorkerPool pool(1, 3);
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(pool.Submit([&](int) {
                        gate.Wait();
                        ++num_run;
                      })
                      .ok());
    }
    const absl::Status refused = pool.Submit([&](int) { num_run += 100; });
    EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted) << refused;
    gate.Open();
  }
  EXPECT_EQ(num_run, 3);
}

TEST(WorkerPool, TakesTasksAgainOnceOthersAreDone) {
  WorkerPool pool(1, 1);
  for (int i = 0; i < 100; ++i) {
    std::promise<void> done;
    // The task before may not be counted out yet, though it has told that it is done.
    while (!pool.Submit([&](int) { done.set_value(); }).ok()) std::this_thread::yield();
    done.get_future().wait();
  }
}

TEST(WorkerPool, NumbersItsThreads) {
  std::mutex mutex;
  std::set<int> workers;
  {
    WorkerPool pool(3, 3);
    EXPECT_EQ(pool.num_threads(), 3);
    test::Gate gate;
    std::atomic<int> num_waiting = 0;
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(pool.Submit([&](int worker) {
                        if (++num_waiting == 3) gate.Open();
                        gate.Wait();
                        const std::lock_guard lock(mutex);
                        workers.insert(worker);
                      })
                      .ok());
    }
    gate.Wait();
  }
  EXPECT_EQ(workers, (std::set<int>{0, 1, 2}));
}

TEST(WorkerPool, FreesWhatATaskHolds) {
  auto held = std::make_shared<int>(1);
  const std::weak_ptr<int> watched = held;
  {
    WorkerPool pool(1, 2);
    ASSERT_TRUE(pool.Submit([held = std::move(held)](int) {}).ok());
  }
  EXPECT_TRUE(watched.expired());
}

}  // namespace
}  // namespace scanloc::server
