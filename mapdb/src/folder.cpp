#include "folder.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>

#include "absl/strings/str_cat.h"

namespace scanloc::mapdb {
namespace {

absl::Status ErrnoError(int error, absl::string_view what, const std::string& path) {
  return absl::ErrnoToStatus(error, absl::StrCat("cannot ", what, " '", path, "'"));
}

}  // namespace

absl::Status SyncFolderOf(const std::string& path) {
  const std::filesystem::path parent = std::filesystem::path(path).parent_path();
  const std::string folder = parent.empty() ? "." : parent.string();
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
