#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace scanloc {

/// An open file or socket, closed with it.
class FileDescriptor {
 public:
  explicit FileDescriptor(int number) : number_(number) {}
  FileDescriptor(FileDescriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~FileDescriptor();

  /// Negative if there is none.
  [[nodiscard]] int get() const { return number_; }

 private:
  int number_ = -1;
};

/// Opens a regular file. What is none is refused at once: a pipe would be waited for, and a device
/// may have no end. InvalidArgument then; NotFound, PermissionDenied and such as the system says.
[[nodiscard]] absl::StatusOr<FileDescriptor> OpenRegularFile(const std::string& path);

/// Hands what a regular file holds to `take`, block by block, up to the first error.
[[nodiscard]] absl::Status ReadBlocks(const std::string& path,
                                      absl::FunctionRef<absl::Status(std::string_view)> take);

/// What a regular file holds. ResourceExhausted if that is more than max_bytes.
[[nodiscard]] absl::StatusOr<std::string> ReadFile(const std::string& path, std::int64_t max_bytes);

/// False, with errno, if not all could be written; a full disk takes a part first.
[[nodiscard]] bool WriteAll(const FileDescriptor& file, std::string_view bytes);

}  // namespace scanloc
