#include "cli/output.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::cli {
namespace {

// The file that a link leads to, there or not yet, so that the link is not replaced by it.
std::string Resolve(const std::string& path) {
  constexpr int kMostLinks = 40;
  std::error_code error;
  std::filesystem::path resolved = path;
  for (int i = 0; i < kMostLinks && std::filesystem::is_symlink(resolved, error); ++i) {
    resolved = resolved.parent_path() / std::filesystem::read_symlink(resolved, error);
  }
  return resolved;
}

// As maps, bags and most scans have them; what is written here begins with text.
bool HoldsZeros(const std::string& path) {
  char head[4096];
  const FileDescriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  const ssize_t num_read = read(file.get(), head, sizeof(head));
  return num_read > 0 && std::memchr(head, 0, static_cast<std::size_t>(num_read)) != nullptr;
}

}  // namespace

void PrepareStandardStreams() {
  for (int fd = 0; fd <= 2; ++fd) {
    if (fcntl(fd, F_GETFD) != -1) continue;
    // Takes the lowest free number, which is fd. Opened the wrong way round, so that using it
    // fails.
    if (open("/dev/null", fd == 0 ? O_WRONLY : O_RDONLY) == -1) _exit(1);
  }
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

absl::Status WriteText(const std::string& path, std::string_view text) {
  const auto failed = [&path] {
    return absl::ErrnoToStatus(
        errno, absl::StrCat("cannot write to ", path == "-" ? "standard output" : path));
  };
  struct stat info = {};
  const bool exists = path != "-" && stat(path.c_str(), &info) == 0;
  if (exists && S_ISDIR(info.st_mode)) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot write ", path, ": it is a folder; name a file"));
  }
  if (path == "-" || (exists && !S_ISREG(info.st_mode))) {
    const FileDescriptor file(path == "-" ? dup(STDOUT_FILENO)
                                          : open(path.c_str(), O_WRONLY | O_CLOEXEC));
    return file.get() >= 0 && WriteAll(file, text) ? absl::OkStatus() : failed();
  }
  const std::string target = Resolve(path);
  if (exists && HoldsZeros(target)) {
    return absl::AlreadyExistsError(
        absl::StrCat("cannot write ", path, ": a file is there that holds no text, as a map or a ",
                     "scan; remove it or choose another name"));
  }
  const std::string temporary = absl::StrCat(target, ".", getpid(), ".tmp");
  const FileDescriptor file(
      open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file.get() < 0) return failed();
  if (WriteAll(file, text) && fsync(file.get()) == 0 &&
      std::rename(temporary.c_str(), target.c_str()) == 0) {
    return absl::OkStatus();
  }
  absl::Status status = failed();
  unlink(temporary.c_str());
  return status;
}

absl::Status WriteReport(const std::string& folder,
                         const std::vector<std::pair<std::string, std::string>>& files) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return absl::PermissionDeniedError(
        absl::StrCat("cannot make folder '", folder, "': ", error.message()));
  }
  for (const auto& [name, text] : files) {
    const std::filesystem::path path = std::filesystem::path(folder) / name;
    std::filesystem::create_directories(path.parent_path(), error);  // or WriteText says what
    RETURN_IF_ERROR(WriteText(path, text));
  }
  return absl::OkStatus();
}

}  // namespace scanloc::cli
