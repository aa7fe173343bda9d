#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "absl/status/statusor.h"
#include "ops/logs.hpp"
#include "ops/metrics.hpp"
#include "scanloc/files/files.hpp"
#include "scanloc/v1/capture.pb.h"

namespace scanloc::server {

/// Keeps queries that found no place in a folder, for `scanloc locate --replay`; the oldest files
/// go when it gets too large. Writes on a thread of its own: what the disk is too slow for is
/// dropped. Thread-safe.
class QueryCapture {
 public:
  /// Makes the folder if there is none, for the server's user alone, and takes over files of its
  /// own that an earlier server left. max_bytes bounds what they take of the disk: whole blocks,
  /// and half a kB for the name of each. InvalidArgument: it is no folder, or cannot be made or
  /// written to. AlreadyExists: another process has it.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<QueryCapture>> Open(const std::string& folder,
                                                                          std::int64_t max_bytes,
                                                                          Metrics& metrics);

  /// Writes what is still waiting.
  ~QueryCapture();

  void Keep(v1::CapturedQuery query);

 private:
  struct File {
    std::filesystem::path path;
    std::int64_t num_bytes = 0;
  };

  QueryCapture(std::filesystem::path folder, FileDescriptor lock, std::int64_t max_bytes,
               Metrics& metrics)
      : folder_(std::move(folder)),
        lock_(std::move(lock)),
        max_bytes_(max_bytes),
        metrics_(metrics),
        log_limit_(1, kLogPeriod_ns) {}

  static constexpr std::int64_t kLogPeriod_ns = 60'000'000'000;

  void Adopt();
  void Run();
  void Tell(const absl::Status& failure);
  [[nodiscard]] absl::Status Write(const v1::CapturedQuery& query);
  void RemoveOldest();

  const std::filesystem::path folder_;
  const FileDescriptor lock_;
  const std::int64_t max_bytes_;
  Metrics& metrics_;
  LogLimit log_limit_;      // a full disk fails every query
  std::deque<File> files_;  // of the writing thread; oldest first
  std::int64_t num_bytes_ = 0;
  std::uint64_t num_written_ = 0;

  std::mutex mutex_;
  std::condition_variable has_work_;
  std::deque<v1::CapturedQuery> waiting_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace scanloc::server
