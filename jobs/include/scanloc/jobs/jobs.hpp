#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace scanloc {

/// The most that may be asked for.
inline constexpr int kMaxThreads = 256;

/// Threads for a number of them as given on the command line: 0 is one a processor.
[[nodiscard]] std::size_t NumThreads(int asked);

/// Threads that each do work(worker), counted from 0: as many of those wanted as the machine lets
/// be started. They are joined when they go. ResourceExhausted: not one could be.
[[nodiscard]] absl::StatusOr<std::vector<std::jthread>> StartThreads(
    std::size_t num_wanted, const std::function<void(std::size_t worker)>& work);

/// One job of RunJobs; no two at once have the same worker, which counts from 0.
using NumberedJob = std::function<absl::Status(std::size_t number, std::size_t worker)>;

/// Does the jobs 0 ... num_jobs - 1 on up to so many threads. `told` is called from this thread
/// with how many are done. Returns the error of the first job, in order, that fails; no new ones
/// are begun then. ResourceExhausted: no thread could be started.
[[nodiscard]] absl::Status RunJobs(std::size_t num_threads, std::size_t num_jobs,
                                   const NumberedJob& job,
                                   const std::function<void(std::size_t num_done)>& told);

/// Does the tasks on up to so many threads; on this one, if it is to be one. ResourceExhausted: no
/// thread could be started.
[[nodiscard]] absl::Status RunTasks(std::size_t num_threads,
                                    std::span<const std::function<void()>> tasks);

/// Does both, the second on a thread of its own; behind the first where there is no second
/// processor or no further thread. Costs some 20 us. What they throw is thrown once both have
/// ended.
void RunBoth(const std::function<void()>& first, const std::function<void()>& second);

}  // namespace scanloc
