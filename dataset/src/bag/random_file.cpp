#include "bag/random_file.hpp"

#include <libdeflate.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {

std::uint32_t Crc32(std::string_view bytes, std::uint32_t before) {
  return libdeflate_crc32(before, bytes.data(), bytes.size());
}

absl::StatusOr<RandomFile> RandomFile::Open(const std::string& path) {
  ASSIGN_OR_RETURN(FileDescriptor file, OpenRegularFile(path));
  struct stat info {};
  if (fstat(file.get(), &info) != 0) return absl::ErrnoToStatus(errno, path);
  if (info.st_size == 0) return absl::InvalidArgumentError(absl::StrCat(path, ": is empty"));
  return RandomFile(std::move(file), path, static_cast<std::uint64_t>(info.st_size));
}

absl::Status RandomFile::ReadAt(std::uint64_t offset, std::size_t num_bytes, char* out) const {
  if (offset > size_ || num_bytes > size_ - offset) {
    return absl::InvalidArgumentError(absl::StrCat(path_, ": truncated: ", num_bytes,
                                                   " bytes are needed at ", offset, " of ", size_));
  }
  for (std::size_t done = 0; done < num_bytes;) {
    const ssize_t n =
        pread(file_.get(), out + done, num_bytes - done, static_cast<off_t>(offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return absl::ErrnoToStatus(errno, path_);
    if (n == 0) {
      return absl::InvalidArgumentError(absl::StrCat(path_, ": shrank while it was read"));
    }
    done += static_cast<std::size_t>(n);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> RandomFile::ReadText(std::uint64_t offset, std::size_t num_bytes) const
    try {
  if (offset > size_ || num_bytes > size_ - offset) return ReadAt(offset, num_bytes, nullptr);
  std::string text(num_bytes, '\0');
  RETURN_IF_ERROR(ReadAt(offset, num_bytes, text.data()));
  return text;
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError(absl::StrCat(path_, ": no memory for ", num_bytes, " bytes"));
}

absl::StatusOr<std::uint32_t> RandomFile::ChecksumOf(std::uint64_t begin, std::uint64_t end) const {
  std::array<char, 64 << 10> block;  // stays in the processor's cache
  std::uint32_t checksum = 0;
  for (std::uint64_t at = begin; at < end; at += block.size()) {
    const std::size_t num_bytes = std::min<std::uint64_t>(block.size(), end - at);
    RETURN_IF_ERROR(ReadAt(at, num_bytes, block.data()));
    checksum = Crc32({block.data(), num_bytes}, checksum);
  }
  return checksum;
}

}  // namespace scanloc::dataset
