#include "file_bytes.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

absl::Status CheckSize(const std::string& path, const struct stat& info, std::int64_t max_bytes) {
  if (info.st_size == 0) return absl::InvalidArgumentError(absl::StrCat(path, ": is empty"));
  if (info.st_size > max_bytes) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": holds ", info.st_size, " bytes; at most ", max_bytes, " are read"));
  }
  return absl::OkStatus();
}

// How a file begins that stands for another; as floats all are no coordinates.
struct Substitute {
  std::string_view begin;
  std::string_view what;
};
constexpr std::string_view kPage =
    "is a page that a server sent, not the file itself; fetch it again";
constexpr std::array<Substitute, 11> kSubstitutes = {{
    {"version https://git-lfs.github.com/spec/",
     "is a Git LFS pointer, not the file itself; fetch that with `git lfs pull`"},
    {"/annex/objects/",
     "is a git-annex pointer, not the file itself; fetch that with `git annex get`"},
    {"<!DOCTYPE", kPage},
    {"<!doctype", kPage},
    {"<html", kPage},
    {"<HTML", kPage},
    {"<?xml", kPage},
    {"BZh91AY&SY", "is compressed by bzip2; decompress it with `bunzip2` first"},
    {"\xFD"
     "7zXZ",
     "is compressed by xz; decompress it with `unxz` first"},
    {"\x28\xB5\x2F\xFD", "is compressed by zstd; decompress it with `unzstd` first"},
    {"PK\x03\x04", "is a zip archive; unpack it with `unzip` first"},
}};

}  // namespace

absl::StatusOr<FileBytes> ReadFileBytes(const std::string& path, std::int64_t max_bytes) {
  ASSIGN_OR_RETURN(const FileDescriptor file, OpenRegularFile(path));
  struct stat info {};
  if (fstat(file.get(), &info) != 0) return absl::ErrnoToStatus(errno, path);
  RETURN_IF_ERROR(CheckSize(path, info, max_bytes));

  const auto size = static_cast<std::size_t>(info.st_size);
  std::unique_ptr<char[]> data(new (std::nothrow) char[size]);
  if (data == nullptr) {
    return absl::ResourceExhaustedError(absl::StrCat(path, ": no memory for its ", size, " bytes"));
  }
  std::size_t num_read = 0;
  while (num_read < size) {
    const ssize_t n = read(file.get(), data.get() + num_read, size - num_read);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return absl::ErrnoToStatus(errno, path);
    if (n == 0) {
      return absl::InvalidArgumentError(
          absl::StrCat(path, ": shrank from ", size, " to ", num_read, " bytes while it was read"));
    }
    num_read += static_cast<std::size_t>(n);
  }
  FileBytes bytes(std::move(data), size);
  RETURN_IF_ERROR(CheckIsItself(path, bytes.view()));
  return bytes;
}

absl::Status CheckIsItself(const std::string& path, std::string_view begin) {
  for (const auto& [first, what] : kSubstitutes) {
    if (!begin.starts_with(first)) continue;
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", ToAbsl(what)));
  }
  // With the byte behind them, they are smaller than any coordinate.
  constexpr std::string_view kGzip = "\x1F\x8B\x08";
  if (begin.size() > 3 && begin.starts_with(kGzip) && begin[3] >= 0 && begin[3] < ' ') {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": is compressed by gzip; decompress it with `gunzip` first"));
  }
  return absl::OkStatus();
}

absl::Status Annotate(const absl::Status& status, std::string_view context) {
  if (status.ok()) return status;
  return {status.code(), absl::StrCat(ToAbsl(context), ": ", status.message())};
}

absl::Status WithNotes(const absl::Status& error, const std::vector<std::string>& notes) {
  if (notes.empty()) return error;
  return {error.code(),
          absl::StrCat(error.message(), "; noticed before: ", absl::StrJoin(notes, "; "))};
}

}  // namespace scanloc::dataset
