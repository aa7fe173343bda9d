#include "text_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/files/files.hpp"

namespace scanloc::catalogue {
namespace {

constexpr std::int64_t kMaxFileBytes = 64 << 20;

}  // namespace

absl::Status WriteTextFile(const std::string& path, const std::string& text) {
  const std::string next = absl::StrCat(path, ".next");
  const FileDescriptor file(open(next.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  const bool is_written = file.get() >= 0 && WriteAll(file, text) && fsync(file.get()) == 0 &&
                          rename(next.c_str(), path.c_str()) == 0;
  const int why = errno;
  if (is_written) return absl::OkStatus();
  unlink(next.c_str());
  return absl::ResourceExhaustedError(
      absl::StrCat("cannot write '", path, "': ", std::strerror(why), "; it is as it was"));
}

absl::StatusOr<std::string> ReadTextFile(const std::string& path) {
  absl::StatusOr<std::string> text = ReadFile(path, kMaxFileBytes);
  if (absl::IsNotFound(text.status())) return std::string();
  return text.ok() ? std::move(text) : absl::UnavailableError(text.status().message());
}

}  // namespace scanloc::catalogue
