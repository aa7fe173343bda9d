// Queues while memory is short: this program's own operator new fails where a test wants it to.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <string>

#include "scanloc/server/fair_queue.hpp"
#include "scanloc/server/worker_pool.hpp"

namespace {
/// Allocations of this thread until one fails; negative: none does.
thread_local int num_allowed = -1;
}  // namespace

void* operator new(std::size_t size) {
  if (num_allowed == 0) throw std::bad_alloc();
  if (num_allowed > 0) --num_allowed;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }

namespace scanloc::server {
namespace {

const std::string kClient = "a client whose name is too long to need no memory";

/// Runs the work with one allocation allowed, then two and so on, up to where it succeeds; how
/// often it failed.
template <typename Work>
int FailAtEachAllocation(Work&& work) {
  for (int count = 0;; ++count) {
    bool is_done = false;
    num_allowed = count;
    try {
      is_done = work();
    } catch (const std::bad_alloc&) {
    }
    num_allowed = -1;
    if (is_done) return count;
  }
}

TEST(FairLineWithoutMemory, StaysAsItWasWhenATaskCannotBeAdded) {
  int num_run = 0;
  for (int num_before = 0; num_before < 3; ++num_before) {
    FairQueue line;
    const auto turn = [&] {
      return FairQueue::Turn{kClient, [&](const absl::StatusOr<int>&) { ++num_run; }};
    };
    for (int i = 0; i < num_before; ++i) line.Add(turn());
    FairQueue::Turn added = turn();
    const int num_failed = FailAtEachAllocation([&] {
      EXPECT_EQ(line.size(), num_before);
      line.Add(std::move(added));
      return true;
    });
    EXPECT_EQ(num_failed > 0, num_before == 0);
    EXPECT_EQ(line.size(), num_before + 1);
    num_run = 0;
    num_allowed = 0;  // to take a turn needs none
    for (int i = 0; i <= num_before; ++i) line.TakeNext(0.01).task(0);
    num_allowed = -1;
    EXPECT_EQ(num_run, num_before + 1);
    EXPECT_EQ(line.size(), 0);
  }
}

TEST(WorkerPoolWithoutMemory, RefusesOrRunsEveryTask) {
  WorkerPool pool(1, 1000);
  std::atomic<int> num_run = 0;
  int num_taken = 0;
  const int num_failed = FailAtEachAllocation([&] {
    const absl::Status taken =
        pool.Submit(kClient, [&num_run](const absl::StatusOr<int>&) { ++num_run; });
    num_taken += taken.ok() ? 1 : 0;
    return taken.ok();
  });
  EXPECT_GT(num_failed, 0);
  pool.Finish();
  EXPECT_EQ(num_run, num_taken);
}

}  // namespace
}  // namespace scanloc::server
