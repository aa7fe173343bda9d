#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <random>
#include <vector>

#include "absl/strings/str_cat.h"
#include "kinds.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::catalogue {
namespace {

namespace fs = std::filesystem;

absl::Status FailedTo(absl::string_view what, const std::string& path, int error) {
  const std::string text = absl::StrCat("cannot ", what, " '", path, "': ", std::strerror(error));
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) {
    return absl::ResourceExhaustedError(absl::StrCat(text, "; make room on the disk"));
  }
  return absl::UnavailableError(text);
}

absl::Status Copy(const std::string& from, const std::string& to, std::int64_t max_bytes,
                  const std::function<bool()>& go_on) {
  // A pipe would be waited for, which no go_on ends.
  const FileDescriptor source(open(from.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (source.get() < 0 && errno == ENOENT) {
    return absl::NotFoundError(absl::StrCat("the store has no file '", from, "'"));
  }
  if (source.get() < 0) return FailedTo("read", from, errno);
  struct stat info = {};
  if (fstat(source.get(), &info) != 0) return FailedTo("read", from, errno);
  if (!S_ISREG(info.st_mode)) {
    return absl::DataLossError(absl::StrCat("what the store has as '", from, "' is no file"));
  }
  const FileDescriptor target(open(to.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (target.get() < 0) return FailedTo("write", to, errno);
  std::vector<char> block(1 << 20);
  for (std::int64_t sum = 0;;) {
    if (!go_on()) return absl::CancelledError("the transfer was stopped");
    const ssize_t size = read(source.get(), block.data(), block.size());
    if (size < 0) return FailedTo("read", from, errno);
    if (size == 0) break;
    sum += size;
    if (sum > max_bytes) {
      return absl::DataLossError(
          absl::StrCat("'", from, "' has more than the ", max_bytes, " bytes that it should have"));
    }
    if (!WriteAll(target, {block.data(), static_cast<std::size_t>(size)})) {
      return FailedTo("write", to, errno);
    }
  }
  return fsync(target.get()) == 0 ? absl::OkStatus() : FailedTo("write", to, errno);
}

class FolderStore : public Store {
 public:
  explicit FolderStore(std::string folder) : folder_(std::move(folder)) {}

  absl::Status Put(const std::string& name, const std::string& path) override {
    const std::string target = absl::StrCat(folder_, "/", name);
    const absl::StatusOr<std::string> there = Sha256OfFile(target);
    if (there.ok() && there == Sha256OfFile(path)) return absl::OkStatus();
    // Processes in two containers that share the folder may have one number.
    const std::string part = absl::StrCat(target, ".part-", absl::Hex(std::random_device()()),
                                          absl::Hex(std::random_device()()));
    absl::Status status =
        Copy(path, part, std::numeric_limits<std::int64_t>::max(), [] { return true; });
    if (status.ok() && rename(part.c_str(), target.c_str()) != 0) {
      status = FailedTo("rename", part, errno);
    }
    if (!status.ok()) unlink(part.c_str());
    if (status.ok()) RemoveOldParts(target);
    return status;
  }

  absl::Status Get(const std::string& name, const std::string& path, std::int64_t max_bytes,
                   const std::function<bool()>& go_on) override {
    return Copy(absl::StrCat(folder_, "/", name), path, max_bytes, go_on);
  }

 private:
  /// What publishers that were killed left, a day older by the folder's own clock than what was
  /// put.
  void RemoveOldParts(const std::string& put) const {
    constexpr std::chrono::hours kOld(24);
    std::error_code error;
    const fs::file_time_type now = fs::last_write_time(put, error);
    if (error) return;
    fs::directory_iterator entry(folder_, error);
    for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
      std::error_code gone;
      if (entry->path().filename().string().find(".scanloc.part-") == std::string::npos) continue;
      if (fs::last_write_time(entry->path(), gone) < now - kOld && !gone) {
        fs::remove(entry->path(), gone);
      }
    }
  }

  std::string folder_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Store>> OpenFolderStore(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    return absl::UnavailableError(
        absl::StrCat("cannot make the store's folder '", folder, "': ", error.message()));
  }
  return std::make_unique<FolderStore>(folder);
}

}  // namespace scanloc::catalogue
