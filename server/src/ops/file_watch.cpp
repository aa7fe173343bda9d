#include "ops/file_watch.hpp"

#include <fcntl.h>
#include <openssl/sha.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::server {
namespace {

constexpr std::chrono::seconds kLookInterval(1);
constexpr std::size_t kMaxFileBytes = 16 << 20;

/// An open file, closed with it.
class File {
 public:
  /// What is no regular file must not make anybody wait.
  explicit File(const std::string& path)
      : descriptor_(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)) {}
  ~File() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  [[nodiscard]] int descriptor() const { return descriptor_; }

 private:
  const int descriptor_;
};

}  // namespace

absl::StatusOr<std::string> ReadSmallFile(const std::string& path) {
  const auto cannot = [&](int error) {
    return absl::ErrnoToStatus(error, absl::StrCat("cannot read '", Printable(path), "'"));
  };
  const File file(path);
  if (file.descriptor() < 0) return cannot(errno);
  struct stat status = {};
  if (fstat(file.descriptor(), &status) != 0) return cannot(errno);
  if (!S_ISREG(status.st_mode)) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot read '", Printable(path), "': it is not a regular file"));
  }
  std::string text;
  std::array<char, 65536> piece;
  while (true) {
    const ssize_t num_read = read(file.descriptor(), piece.data(), piece.size());
    if (num_read < 0 && errno == EINTR) continue;
    if (num_read < 0) return cannot(errno);
    if (num_read == 0) return text;
    text.append(piece.data(), static_cast<std::size_t>(num_read));
    if (text.size() > kMaxFileBytes) {
      return absl::ResourceExhaustedError(absl::StrCat(
          "cannot read '", Printable(path), "': it has more than ", kMaxFileBytes, " bytes"));
    }
  }
}

absl::Status FileWatch::ReadAll(Texts& texts) const {
  for (const std::string& path : subject_.paths) {
    ASSIGN_OR_RETURN(auto text, ReadSmallFile(path));
    texts.push_back(std::move(text));
  }
  return absl::OkStatus();
}

FileWatch::Digest FileWatch::DigestOf(const Texts& texts) {
  std::string all;
  for (const std::string& text : texts) absl::StrAppend(&all, text.size(), ":", text);
  Digest digest;
  SHA256(reinterpret_cast<const unsigned char*>(all.data()), all.size(), digest.data());
  return digest;
}

absl::Status FileWatch::Look(Clock::time_point now) {
  Texts texts;
  absl::Status status = ReadAll(texts);
  const Digest found = DigestOf(texts);
  if (status.ok() && found != known_) {
    status = subject_.take_up(texts);
    if (status.ok()) known_ = found;
  }
  if (!status.ok()) {
    NoteTrouble(status, found, now);
    return status;
  }
  bad_.reset();
  if (std::exchange(is_told_, false)) spdlog::info("{}: can be used again", subject_.name);
  const std::lock_guard lock(mutex_);
  unknown_since_.reset();
  return absl::OkStatus();
}

void FileWatch::NoteTrouble(const absl::Status& why, const Digest& found, Clock::time_point now) {
  if (why != why_bad_ || found != bad_) {
    why_bad_ = why;
    bad_ = found;
    is_told_ = false;
  } else if (!std::exchange(is_told_, true)) {
    subject_.on_trouble();
    spdlog::error("{}: what was before stays in force: {}", subject_.name,
                  absl::StrCat(why.message()));
  }
  const std::lock_guard lock(mutex_);
  if (!unknown_since_) unknown_since_ = now;
}

FileWatch::Clock::duration FileWatch::UnknownFor(Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  return unknown_since_ ? now - *unknown_since_ : Clock::duration::zero();
}

void FileWatch::Start(Tell tell) {
  tell(subject_.name, false);
  thread_ = std::jthread(
      [this, tell = std::move(tell)](const std::stop_token& stop) { Run(stop, tell); });
}

void FileWatch::Run(const std::stop_token& stop, const Tell& tell) {
  std::unique_lock lock(mutex_);
  while (!ends_.wait_for(lock, stop, kLookInterval, [&] { return stop.stop_requested(); })) {
    lock.unlock();
    (void)Look();  // what is wrong is told by it
    tell(subject_.name, is_told_);
    lock.lock();
  }
}

}  // namespace scanloc::server
