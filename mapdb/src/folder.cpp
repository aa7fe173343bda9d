#include "folder.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>

#include "absl/strings/str_cat.h"

namespace scanloc::mapdb {
namespace {

absl::Status ErrnoError(int error, absl::string_view what, const std::string& path) {
  return absl::ErrnoToStatus(error, absl::StrCat("cannot ", what, " '", path, "'"));
}

std::string FolderOf(const std::string& path) {
  const std::filesystem::path parent = std::filesystem::path(path).parent_path();
  return parent.empty() ? "." : parent.string();
}

// A writer's connection locks bytes of its file.
bool IsLocked(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  struct flock lock {};
  lock.l_type = F_WRLCK;
  const bool is_free = fd >= 0 && fcntl(fd, F_GETLK, &lock) == 0 && lock.l_type == F_UNLCK;
  if (fd >= 0) close(fd);
  return !is_free;
}

}  // namespace

void RemoveLeftBehind(const std::string& begin) {
  namespace fs = std::filesystem;
  constexpr std::chrono::hours kOld(1);
  const std::string name = fs::path(begin).filename().string();
  const std::string own = absl::StrCat(name, getpid());  // to look would let go of our own locks
  std::error_code error;
  fs::directory_iterator entry(FolderOf(begin), error);
  for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
    const std::string path = entry->path().string();
    const std::string found = entry->path().filename().string();
    if (!found.starts_with(name) || found.starts_with(own)) continue;
    std::error_code gone;
    const auto age = fs::file_time_type::clock::now() - entry->last_write_time(gone);
    if (!gone && age > kOld && entry->is_regular_file(gone) && !IsLocked(path)) {
      fs::remove(path, gone);
    }
  }
}

absl::Status SyncFolderOf(const std::string& path) {
  const std::string folder = FolderOf(path);
  const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  // A folder that may be written but not read cannot be synced; a file system may know no such
  // sync.
  if (fd < 0 && errno == EACCES) return absl::OkStatus();
  if (fd < 0) return ErrnoError(errno, "open folder", folder);
  const int error = fsync(fd) == 0 || errno == EINVAL || errno == ENOTSUP ? 0 : errno;
  close(fd);
  return error == 0 ? absl::OkStatus() : ErrnoError(error, "sync folder", folder);
}

absl::Status RenameFile(const std::string& from, const std::string& to) {
  if (std::rename(from.c_str(), to.c_str()) != 0) return ErrnoError(errno, "make", to);
  return SyncFolderOf(to);
}

absl::Status RenameNew(const std::string& from, const std::string& to) {
  int error =
      renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0 ? 0 : errno;
  // Some file systems know no such rename: there the new name comes first, and the old one goes.
  if (error == EINVAL || error == ENOSYS) {
    error = link(from.c_str(), to.c_str()) == 0 && unlink(from.c_str()) == 0 ? 0 : errno;
  }
  if (error != 0) return ErrnoError(error, "make", to);
  return SyncFolderOf(to);
}

absl::Status RemoveFile(const std::string& path) {
  if (unlink(path.c_str()) != 0) return ErrnoError(errno, "remove", path);
  return SyncFolderOf(path);
}

}  // namespace scanloc::mapdb
