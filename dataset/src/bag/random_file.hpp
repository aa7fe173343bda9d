#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/files/files.hpp"

namespace scanloc::dataset {

/// The checksum of zlib and MCAP; of what follows bytes of checksum `before`.
[[nodiscard]] std::uint32_t Crc32(std::string_view bytes, std::uint32_t before = 0);

/// A regular file that is read at any place, by any number of threads.
class RandomFile {
 public:
  /// NotFound, PermissionDenied, or InvalidArgument if it is no regular file or empty. Never waits
  /// for a pipe.
  [[nodiscard]] static absl::StatusOr<RandomFile> Open(const std::string& path);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// Reads num_bytes at `offset`. InvalidArgument if they are not all within the file.
  [[nodiscard]] absl::Status ReadAt(std::uint64_t offset, std::size_t num_bytes, char* out) const;
  /// Likewise, into memory of its own.
  [[nodiscard]] absl::StatusOr<std::string> ReadText(std::uint64_t offset,
                                                     std::size_t num_bytes) const;
  /// The checksum (Crc32) of what is from `begin` to before `end`.
  [[nodiscard]] absl::StatusOr<std::uint32_t> ChecksumOf(std::uint64_t begin,
                                                         std::uint64_t end) const;

 private:
  RandomFile(FileDescriptor file, std::string path, std::uint64_t size)
      : file_(std::move(file)), path_(std::move(path)), size_(size) {}

  FileDescriptor file_;
  std::string path_;
  std::uint64_t size_ = 0;
};

}  // namespace scanloc::dataset
