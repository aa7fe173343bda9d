#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace scanloc::cli {

/// Keeps files that are opened later off the numbers of standard streams that the caller closed,
/// and makes a closed pipe, or a file as long as files may be, an error of the write instead of a
/// signal. Call first in main.
void PrepareStandardStreams();

/// Text for stdout or a file; every failed write is told.
///
/// A regular file appears under its name only once all of it is on disk, in place of one that was
/// there before and held text; until then, and for ever if Close is not called, it is left as it
/// was. Devices and pipes are written directly.
class TextOutput {
 public:
  /// "-" is stdout. AlreadyExists: a map, a scan or the like is there. NotFound, PermissionDenied,
  /// InvalidArgument (a folder) and the like, naming the path.
  [[nodiscard]] static absl::StatusOr<TextOutput> Open(const std::string& path);

  TextOutput(TextOutput&& other) noexcept;
  TextOutput& operator=(TextOutput&&) = delete;
  ~TextOutput();

  /// Buffered. The first error sticks, and Close returns it.
  void Append(std::string_view text);

  /// Writes what is left. ResourceExhausted: the disk is full. Unavailable: the reader closed the
  /// pipe.
  [[nodiscard]] absl::Status Close();

 private:
  TextOutput() = default;
  void Flush();

  std::string target_;     // empty: stdout
  std::string temporary_;  // empty: written directly
  int fd_ = -1;
  std::string buffer_;
  absl::Status status_;
};

/// Writes all of the text to the path, or to stdout if it is "-".
[[nodiscard]] absl::Status WriteText(const std::string& path, std::string_view text);

/// Writes files, each name and text, into a folder that is made if need be. PermissionDenied: it
/// cannot be made.
[[nodiscard]] absl::Status WriteReport(
    const std::string& folder, const std::vector<std::pair<std::string, std::string>>& files);

}  // namespace scanloc::cli
