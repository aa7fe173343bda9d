#include "text_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "absl/strings/str_cat.h"

namespace scanloc::catalogue {
namespace {

constexpr std::uintmax_t kMaxFileBytes = 64 << 20;

}  // namespace

bool WriteAll(int fd, absl::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t size = write(fd, bytes.data(), bytes.size());  // a full disk takes a part first
    if (size < 0 && errno != EINTR) return false;
    if (size > 0) bytes.remove_prefix(static_cast<std::size_t>(size));
  }
  return true;
}

absl::Status WriteTextFile(const std::string& path, const std::string& text) {
  const std::string next = absl::StrCat(path, ".next");
  const int file = open(next.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  const bool is_written = file >= 0 && WriteAll(file, text) && fsync(file) == 0 &&
                          rename(next.c_str(), path.c_str()) == 0;
  const int why = errno;
  if (file >= 0) close(file);
  if (is_written) return absl::OkStatus();
  unlink(next.c_str());
  return absl::ResourceExhaustedError(
      absl::StrCat("cannot write '", path, "': ", std::strerror(why), "; it is as it was"));
}

absl::StatusOr<std::string> ReadTextFile(const std::string& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error == std::errc::no_such_file_or_directory) return std::string();
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  if (error || size > kMaxFileBytes || (size > 0 && !(text << file.rdbuf()))) {
    return absl::UnavailableError(absl::StrCat("cannot read '", path, "'"));
  }
  return text.str();
}

}  // namespace scanloc::catalogue
