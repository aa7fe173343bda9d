#include "scanloc/server/worker_pool.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "scanloc/proto/status.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

TEST(WorkerPool, RunsEveryTaskItTakes) {
  std::atomic<int> num_run = 0;
  {
    WorkerPool pool(4, 1000);
    for (int i = 0; i < 1000; ++i) {
      ASSERT_TRUE(pool.Submit("test", [&](const absl::StatusOr<int>&) { ++num_run; }).ok());
    }
  }
  EXPECT_EQ(num_run, 1000);
}

TEST(WorkerPool, HasRunEveryTaskWhenItIsFinished) {
  std::atomic<int> num_run = 0;
  WorkerPool pool(4, 1000);
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(pool.Submit("test", [&](const absl::StatusOr<int>&) { ++num_run; }).ok());
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
      ASSERT_TRUE(pool.Submit("test",
                              [&](const absl::StatusOr<int>&) {
                                gate.Wait();
                                ++num_run;
                              })
                      .ok());
    }
    const absl::Status refused =
        pool.Submit("test", [&](const absl::StatusOr<int>&) { num_run += 100; });
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
    while (!pool.Submit("test", [&](const absl::StatusOr<int>&) { done.set_value(); }).ok())
      std::this_thread::yield();
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
      ASSERT_TRUE(pool.Submit("test",
                              [&](const absl::StatusOr<int>& worker) {
                                if (++num_waiting == 3) gate.Open();
                                gate.Wait();
                                const std::lock_guard lock(mutex);
                                workers.insert(*worker);
                              })
                      .ok());
    }
    gate.Wait();
  }
  EXPECT_EQ(workers, (std::set<int>{0, 1, 2}));
}

/// A pool of one thread that is kept busy until Open, and the order in which tasks ran since.
class HeldPool {
 public:
  explicit HeldPool(int max_inflight) : pool_(1, max_inflight) {
    std::promise<void> begun;
    EXPECT_TRUE(pool_
                    .Submit("holder",
                            [&](const absl::StatusOr<int>&) {
                              begun.set_value();
                              gate_.Wait();
                            })
                    .ok());
    begun.get_future().wait();
  }
  ~HeldPool() { gate_.Open(); }

  absl::Status Submit(const std::string& client, const std::string& task) {
    return pool_.Submit(client, [this, task](const absl::StatusOr<int>& worker) {
      (worker.ok() ? ran_ : refused_).push_back(task);
      if (!worker.ok()) why_ = worker.status();
    });
  }

  void SubmitPatiently(const std::string& client, const std::string& task) {
    pool_.SubmitPatiently(client,
                          [this, task](const absl::StatusOr<int>&) { ran_.push_back(task); });
  }

  [[nodiscard]] absl::Status CheckRoomFor(const std::string& client) const {
    return pool_.CheckRoomFor(client);
  }
  [[nodiscard]] WorkerPool::Load load() const { return pool_.load(); }
  [[nodiscard]] const std::vector<std::string>& refused() const { return refused_; }
  [[nodiscard]] const absl::Status& why() const { return why_; }
  std::vector<std::string> RunAll() {
    gate_.Open();
    pool_.Finish();
    return ran_;
  }

 private:
  test::Gate gate_;
  std::vector<std::string> ran_;
  std::vector<std::string> refused_;
  absl::Status why_;
  WorkerPool pool_;
};

TEST(WorkerPool, LetsClientsTakeTurns) {
  HeldPool pool(10);
  for (const char* task : {"a1", "a2", "a3"}) ASSERT_TRUE(pool.Submit("a", task).ok());
  ASSERT_TRUE(pool.Submit("b", "b1").ok());
  ASSERT_TRUE(pool.Submit("c", "c1").ok());
  EXPECT_EQ(pool.load().num_waiting, 5);
  EXPECT_EQ(pool.load().num_running, 1);
  EXPECT_EQ(pool.RunAll(), (std::vector<std::string>{"a1", "b1", "c1", "a2", "a3"}));
}

TEST(WorkerPool, ChargesClientsForTheTimeOfTheirTasks) {
  std::mutex mutex;
  std::vector<char> ran;
  {
    test::Gate gate;
    WorkerPool pool(1, 100);
    ASSERT_TRUE(pool.Submit("holder", [&](const absl::StatusOr<int>&) { gate.Wait(); }).ok());
    const auto submit = [&](const char* client, std::chrono::milliseconds lasts) {
      return pool.Submit(client, [&, client, lasts](const absl::StatusOr<int>&) {
        const auto end = std::chrono::steady_clock::now() + lasts;
        while (std::chrono::steady_clock::now() < end) {
        }
        const std::lock_guard lock(mutex);
        ran.push_back(*client);
      });
    };
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(submit("long", std::chrono::milliseconds(100)).ok());
      ASSERT_TRUE(submit("short", std::chrono::milliseconds(0)).ok());
    }
    gate.Open();
  }
  // All the short ones have had their turn before the second long one.
  EXPECT_EQ(std::string(ran.begin(), ran.end()), "lsssll");
}

TEST(WorkerPool, MakesRoomForAClientThatHasFewerTasks) {
  HeldPool pool(5);
  for (const char* task : {"a1", "a2", "a3", "a4"}) ASSERT_TRUE(pool.Submit("a", task).ok());
  EXPECT_TRUE(pool.Submit("b", "b1").ok());
  EXPECT_EQ(pool.refused(), std::vector<std::string>{"a4"});
  EXPECT_EQ(pool.why().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(pool.Submit("b", "b2").ok());
  EXPECT_EQ(pool.refused(), (std::vector<std::string>{"a4", "a3"}));
  // Two each: nobody has to give way.
  EXPECT_EQ(pool.Submit("b", "b3").code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(pool.Submit("a", "a5").code(), absl::StatusCode::kResourceExhausted);
  std::vector<std::string> ran = pool.RunAll();
  std::sort(ran.begin(), ran.end());
  EXPECT_EQ(ran, (std::vector<std::string>{"a1", "a2", "b1", "b2"}));
}

TEST(WorkerPool, KeepsPatientTasksUntilThereIsRoom) {
  HeldPool pool(2);
  ASSERT_TRUE(pool.Submit("a", "a1").ok());
  ASSERT_FALSE(pool.Submit("b", "b0").ok());
  for (const char* task : {"b1", "b2", "b3"}) pool.SubmitPatiently("b", task);
  pool.SubmitPatiently("c", "c1");
  EXPECT_EQ(pool.load().num_waiting, 1);
  EXPECT_EQ(pool.RunAll(), (std::vector<std::string>{"a1", "b1", "c1", "b2", "b3"}));
}

TEST(WorkerPool, RunsAPatientTaskAtOnceWhereThereIsRoom) {
  std::promise<void> ran;
  WorkerPool pool(1, 1);
  pool.SubmitPatiently("a", [&](const absl::StatusOr<int>&) { ran.set_value(); });
  ran.get_future().wait();
}

TEST(WorkerPool, TellsWhetherThereIsRoom) {
  HeldPool pool(3);
  EXPECT_TRUE(pool.CheckRoomFor("a").ok());
  for (const char* task : {"a1", "a2"}) ASSERT_TRUE(pool.Submit("a", task).ok());
  EXPECT_TRUE(proto::RetryAfter(pool.CheckRoomFor("a")).has_value());
  EXPECT_TRUE(pool.CheckRoomFor("b").ok());
}

TEST(WorkerPool, RefusesWhatWouldWaitTooLong) {
  test::Gate gate;
  WorkerPool pool(1, 1000, 0.035);  // of tasks that last 0.01 s until it knows better
  const auto submit = [&] {
    return pool.Submit("a", [&](const absl::StatusOr<int>&) { gate.Wait(); });
  };
  int num_taken = 0;
  while (num_taken < 1000 && submit().ok()) ++num_taken;
  // One may run already; of the others four wait, the last for the 0.03 s of those before it.
  EXPECT_GE(num_taken, 4);
  EXPECT_LE(num_taken, 5);
  EXPECT_TRUE(proto::RetryAfter(submit()).has_value());
  gate.Open();
}

TEST(WorkerPool, SaysWhenToComeBack) {
  HeldPool pool(1);
  const auto delay_s = proto::RetryAfter(pool.Submit("a", "a1"));
  ASSERT_TRUE(delay_s.has_value());
  EXPECT_GE(*delay_s, 0.05);
  EXPECT_LE(*delay_s, 60.0);
}

TEST(WorkerPool, FreesWhatATaskHolds) {
  auto held = std::make_shared<int>(1);
  const std::weak_ptr<int> watched = held;
  {
    WorkerPool pool(1, 2);
    ASSERT_TRUE(pool.Submit("test", [held = std::move(held)](const absl::StatusOr<int>&) {}).ok());
  }
  EXPECT_TRUE(watched.expired());
}

}  // namespace
}  // namespace scanloc::server
