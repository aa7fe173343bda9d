#include "cli/output.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::cli {
namespace {

constexpr std::size_t kBufferBytes = 1 << 20;

absl::Status ErrnoStatus(int error, const std::string& target, const char* what) {
  return absl::ErrnoToStatus(
      error, absl::StrCat("cannot ", what, " ", target.empty() ? "standard output" : target));
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
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd == -1) return false;
  const ssize_t num_read = read(fd, head, sizeof(head));
  close(fd);
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

absl::StatusOr<TextOutput> TextOutput::Open(const std::string& path) {
  TextOutput output;
  if (path == "-") {
    output.fd_ = STDOUT_FILENO;
    return output;
  }
  struct stat info = {};
  const bool exists = stat(path.c_str(), &info) == 0;
  output.target_ = exists && !S_ISREG(info.st_mode) ? path : Resolve(path);
  if (exists && S_ISDIR(info.st_mode)) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot write ", path, ": it is a folder; name a file"));
  }
  if (exists && S_ISREG(info.st_mode) && HoldsZeros(output.target_)) {
    return absl::AlreadyExistsError(
        absl::StrCat("cannot write ", path, ": a file is there that holds no text, as a map or a ",
                     "scan; remove it or choose another name"));
  }
  if (exists && !S_ISREG(info.st_mode)) {
    output.fd_ = open(output.target_.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    output.temporary_ = absl::StrCat(output.target_, ".", getpid(), ".tmp");
    output.fd_ = open(output.temporary_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  }
  if (output.fd_ == -1) {
    const int error = errno;
    output.temporary_.clear();
    return ErrnoStatus(error, path, "write");
  }
  return output;
}

TextOutput::TextOutput(TextOutput&& other) noexcept
    : target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})),
      fd_(std::exchange(other.fd_, -1)),
      buffer_(std::move(other.buffer_)),
      status_(std::move(other.status_)) {}

TextOutput::~TextOutput() {
  if (fd_ != -1 && fd_ != STDOUT_FILENO) close(fd_);
  if (!temporary_.empty()) unlink(temporary_.c_str());
}

void TextOutput::Append(std::string_view text) {
  buffer_ += text;
  if (buffer_.size() >= kBufferBytes) Flush();
}

void TextOutput::Flush() {
  std::size_t done = 0;
  while (status_.ok() && done < buffer_.size()) {
    const ssize_t written = write(fd_, buffer_.data() + done, buffer_.size() - done);
    if (written > 0) {
      done += static_cast<std::size_t>(written);
    } else if (written == -1 && errno != EINTR) {
      status_ = ErrnoStatus(errno, target_, "write to");
    }
  }
  buffer_.clear();
}

absl::Status TextOutput::Close() {
  Flush();
  const int fd = std::exchange(fd_, -1);
  if (fd == STDOUT_FILENO) return status_;
  if (status_.ok() && !temporary_.empty() && fsync(fd) == -1) {
    status_ = ErrnoStatus(errno, target_, "write");
  }
  if (close(fd) == -1 && status_.ok()) status_ = ErrnoStatus(errno, target_, "write");
  if (!status_.ok() || temporary_.empty()) return status_;
  if (std::rename(temporary_.c_str(), target_.c_str()) == -1) {
    return status_ = ErrnoStatus(errno, target_, "write");
  }
  temporary_.clear();
  return status_;
}

absl::Status WriteText(const std::string& path, std::string_view text) {
  ASSIGN_OR_RETURN(TextOutput output, TextOutput::Open(path));
  output.Append(text);
  return output.Close();
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
