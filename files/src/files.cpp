#include "scanloc/files/files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc {
namespace {

constexpr std::size_t kBlockBytes = 64 << 10;

std::string CannotRead(const std::string& path) {
  return absl::StrCat("cannot read '", Printable(path), "'");
}

}  // namespace

FileDescriptor::~FileDescriptor() {
  if (number_ >= 0) close(number_);
}

absl::StatusOr<FileDescriptor> OpenRegularFile(const std::string& path) {
  FileDescriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  struct stat info = {};
  if (file.get() < 0 || fstat(file.get(), &info) != 0) {
    return absl::ErrnoToStatus(errno, CannotRead(path));
  }
  if (S_ISREG(info.st_mode)) return file;
  return absl::InvalidArgumentError(absl::StrCat(
      CannotRead(path), S_ISDIR(info.st_mode) ? ": it is a folder" : ": it is not a regular file"));
}

absl::Status ReadBlocks(const std::string& path,
                        absl::FunctionRef<absl::Status(std::string_view)> take) {
  ASSIGN_OR_RETURN(const FileDescriptor file, OpenRegularFile(path));
  std::vector<char> block(kBlockBytes);
  while (true) {
    const ssize_t num_read = read(file.get(), block.data(), block.size());
    if (num_read < 0 && errno == EINTR) continue;
    if (num_read < 0) return absl::ErrnoToStatus(errno, CannotRead(path));
    if (num_read == 0) return absl::OkStatus();
    RETURN_IF_ERROR(take({block.data(), static_cast<std::size_t>(num_read)}));
  }
}

absl::StatusOr<std::string> ReadFile(const std::string& path, std::int64_t max_bytes) {
  std::string text;
  RETURN_IF_ERROR(ReadBlocks(path, [&](std::string_view block) {
    text += block;
    if (static_cast<std::int64_t>(text.size()) <= max_bytes) return absl::OkStatus();
    return absl::ResourceExhaustedError(
        absl::StrCat(CannotRead(path), ": it has more than ", max_bytes, " bytes"));
  }));
  return text;
}

bool WriteAll(const FileDescriptor& file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t size = write(file.get(), bytes.data(), bytes.size());
    if (size < 0 && errno != EINTR) return false;
    if (size > 0) bytes.remove_prefix(static_cast<std::size_t>(size));
  }
  return true;
}

}  // namespace scanloc
