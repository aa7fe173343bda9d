#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace scanloc::dataset {

/// Bytes, and what becomes of their memory when they are not needed any more.
using ByteArray = std::unique_ptr<char[], std::function<void(char*)>>;

/// The bytes of a file, in memory of their own.
class FileBytes {
 public:
  FileBytes(ByteArray data, std::size_t size) : data_(std::move(data)), size_(size) {}

  [[nodiscard]] std::string_view view() const { return {data_.get(), size_}; }

 private:
  ByteArray data_;
  std::size_t size_ = 0;
};

/// Reads a regular file that is not empty and holds at most max_bytes. Never waits for a pipe.
/// NotFound, PermissionDenied, or InvalidArgument with the path and the reason, which may be that
/// of CheckIsItself.
[[nodiscard]] absl::StatusOr<FileBytes> ReadFileBytes(const std::string& path,
                                                      std::int64_t max_bytes);

/// InvalidArgument, with the path and what to do, if a file begins as what stands in its place: a
/// pointer of Git LFS or git-annex, a page that a server sent instead, or a compressed file.
[[nodiscard]] absl::Status CheckIsItself(const std::string& path, std::string_view begin);

/// The same status with "context: " before its message.
[[nodiscard]] absl::Status Annotate(const absl::Status& status, std::string_view context);

/// The same error with what else was noticed behind its message, which may be its cause.
[[nodiscard]] absl::Status WithNotes(const absl::Status& error,
                                     const std::vector<std::string>& notes);

}  // namespace scanloc::dataset
