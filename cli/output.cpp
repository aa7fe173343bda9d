#include "cli/output.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <system_error>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::cli {
namespace {

// Waits for the program's end. NotFound, Internal.
absl::Status Run(std::array<const char*, 5> arguments) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  pid_t pid = 0;
  // The program does not write to its arguments.
  const int error = posix_spawnp(&pid, arguments[0], &actions, nullptr,
                                 const_cast<char* const*>(arguments.data()), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) return absl::ErrnoToStatus(error, arguments[0]);
  int ended = 0;
  while (waitpid(pid, &ended, 0) < 0) {
    if (errno != EINTR) return absl::ErrnoToStatus(errno, arguments[0]);
  }
  if (WIFEXITED(ended) && WEXITSTATUS(ended) == 0) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(arguments[0], " failed"));
}

absl::Status MakePdf(const std::string& svg, const std::string& pdf) {
  const std::string temporary = absl::StrCat(pdf, ".part");
  const std::string output = absl::StrCat("--output=", temporary);
  absl::Status status = Run({"rsvg-convert", "--format=pdf", output.c_str(), svg.c_str(), nullptr});
  if (status.ok() && rename(temporary.c_str(), pdf.c_str()) != 0) {
    status = absl::ErrnoToStatus(errno, pdf);
  }
  if (!status.ok()) unlink(temporary.c_str());
  return status;
}

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

absl::Status MakePdfs(const std::string& folder,
                      const std::vector<std::pair<std::string, std::string>>& files) {
  for (const auto& [name, text] : files) {
    if (!absl::EndsWith(name, ".svg")) continue;
    const std::string front = absl::StrCat(folder, "/", name.substr(0, name.size() - 4));
    absl::Status made = MakePdf(front + ".svg", front + ".pdf");
    if (absl::IsNotFound(made)) {
      std::cerr << "scanloc: note: the figures are made as SVG only; for PDF there must be "
                   "rsvg-convert (Debian: librsvg2-bin)\n";
      return absl::OkStatus();
    }
    if (!made.ok()) return made;
  }
  return absl::OkStatus();
}

}  // namespace scanloc::cli
