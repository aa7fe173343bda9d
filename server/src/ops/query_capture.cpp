#include "ops/query_capture.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include "ops/clock.hpp"

namespace scanloc::server {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxUnwritten = 8;
constexpr const char* kQueryEnding = ".query";
constexpr const char* kUnfinished = ".query.part";
constexpr std::size_t kMaxIdBytesInName = 64;

/// What a file takes of the disk: its blocks, or those that it will have, and its name.
std::int64_t CostOf(const fs::path& path, std::int64_t num_bytes) {
  constexpr std::int64_t kBlockBytes = 4096;
  constexpr std::int64_t kNameBytes = 512;
  struct stat status = {};
  const std::int64_t blocks_bytes =
      stat(path.c_str(), &status) == 0 ? std::int64_t{status.st_blocks} * 512 : 0;
  const std::int64_t whole_bytes = (num_bytes + kBlockBytes - 1) / kBlockBytes * kBlockBytes;
  return std::max(blocks_bytes, whole_bytes) + kNameBytes;
}

/// Sorts by time; holds nothing of the client's but letters, digits and '-'.
std::string FileName(const v1::CapturedQuery& query, std::uint64_t number) {
  const absl::Time received = absl::FromUnixSeconds(query.received().seconds()) +
                              absl::Nanoseconds(query.received().nanos());
  std::string id = query.request_id().substr(0, kMaxIdBytesInName);
  std::replace_if(
      id.begin(), id.end(), [](unsigned char c) { return std::isalnum(c) == 0 && c != '-'; }, '_');
  return absl::StrCat(absl::FormatTime("%Y%m%dT%H%M%E3SZ", received, absl::UTCTimeZone()), "-",
                      absl::StrFormat("%06d", number), "-", id);
}

}  // namespace

absl::StatusOr<std::unique_ptr<QueryCapture>> QueryCapture::Open(const std::string& folder,
                                                                 std::int64_t max_bytes,
                                                                 Metrics& metrics) {
  std::error_code error;
  if (fs::create_directories(folder, error)) {
    fs::permissions(folder, fs::perms::owner_all, error);  // scans of where robots are
  }
  std::error_code none;
  if (!fs::is_directory(folder, none)) {
    return absl::InvalidArgumentError(
        absl::StrCat("the folder for captured queries, ", folder,
                     ", is none and cannot be made: ", error.message()));
  }
  FileDescriptor lock(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  // Some file systems of other machines lock no folders.
  if (flock(lock.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    return absl::AlreadyExistsError(absl::StrCat(
        "the folder for captured queries, ", folder,
        ", is another server's, which takes all files in it for its own; give each ", "its own"));
  }
  const fs::path probe = fs::path(folder) / absl::StrCat("probe", kUnfinished);
  errno = 0;
  if (!std::ofstream(probe, std::ios::binary)) {
    return absl::InvalidArgumentError(
        absl::StrCat("the folder for captured queries, ", folder,
                     ", cannot be written to: ", std::generic_category().message(errno)));
  }
  auto capture = std::unique_ptr<QueryCapture>(
      new QueryCapture(fs::path(folder), std::move(lock), max_bytes, metrics));
  capture->Adopt();
  capture->thread_ = std::thread([raw = capture.get()] { raw->Run(); });
  return capture;
}

QueryCapture::~QueryCapture() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  has_work_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void QueryCapture::Adopt() {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    const std::string name = entry.path().filename().string();
    std::error_code ignored;  // gone meanwhile, or a folder: not ours
    if (name.ends_with(kUnfinished)) {
      fs::remove(entry.path(), ignored);
    } else if (name.ends_with(kQueryEnding) && entry.is_regular_file(ignored)) {
      const auto num_bytes = static_cast<std::int64_t>(entry.file_size(ignored));
      files_.push_back({entry.path(), CostOf(entry.path(), num_bytes)});
    }
  }
  std::ranges::sort(files_, {}, &File::path);
  for (const File& file : files_) num_bytes_ += file.num_bytes;
  RemoveOldest();
}

void QueryCapture::Keep(v1::CapturedQuery query) {
  bool is_taken = false;
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() < kMaxUnwritten) {
      waiting_.push_back(std::move(query));
      is_taken = true;
    }
  }
  if (is_taken) {
    has_work_.notify_one();
  } else {
    metrics_.CountCaptured(false);
    Tell(absl::UnavailableError(
        absl::StrCat("the disk is too slow: ", kMaxUnwritten, " others wait to be written")));
  }
}

void QueryCapture::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    has_work_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const v1::CapturedQuery query = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    const absl::Status written = Write(query);
    metrics_.CountCaptured(written.ok());
    if (!written.ok()) Tell(written);
    lock.lock();
  }
}

void QueryCapture::Tell(const absl::Status& failure) {
  const auto num_left_out = log_limit_.MayLog(NowNs());
  if (!num_left_out) return;
  LogWith(spdlog::level::warn, "query not captured",
          {{"reason", absl::StrCat(failure.message())}, {"not_logged_before", *num_left_out}});
}

absl::Status QueryCapture::Write(const v1::CapturedQuery& query) {
  const std::string bytes = query.SerializeAsString();
  const std::int64_t cost_bytes = CostOf("", static_cast<std::int64_t>(bytes.size()));
  if (cost_bytes > max_bytes_) {
    return absl::ResourceExhaustedError(
        absl::StrCat("it takes ", cost_bytes, " bytes, the whole folder may take ", max_bytes_));
  }
  num_bytes_ += cost_bytes;
  RemoveOldest();
  const std::string name = FileName(query, num_written_++);
  const fs::path unfinished = folder_ / (name + kUnfinished);
  const fs::path path = folder_ / (name + kQueryEnding);
  std::error_code error;
  {
    errno = 0;
    std::ofstream file(unfinished, std::ios::binary | std::ios::trunc);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file) error.assign(errno == 0 ? EIO : errno, std::generic_category());
  }
  if (!error) fs::rename(unfinished, path, error);
  if (error) {
    num_bytes_ -= cost_bytes;
    std::error_code ignored;
    fs::remove(unfinished, ignored);
    return absl::UnavailableError(
        absl::StrCat("cannot write ", path.string(), ": ", error.message()));
  }
  const std::int64_t taken_bytes = CostOf(path, static_cast<std::int64_t>(bytes.size()));
  files_.push_back({path, taken_bytes});
  num_bytes_ += taken_bytes - cost_bytes;
  RemoveOldest();
  return absl::OkStatus();
}

void QueryCapture::RemoveOldest() {
  while (num_bytes_ > max_bytes_ && !files_.empty()) {
    std::error_code ignored;  // somebody took it away: just as well
    fs::remove(files_.front().path, ignored);
    num_bytes_ -= files_.front().num_bytes;
    files_.pop_front();
  }
}

}  // namespace scanloc::server
