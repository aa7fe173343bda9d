#include "ops/file_watch.hpp"

#include <openssl/sha.h>
#include <spdlog/spdlog.h>

#include <cstdint>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::server {
namespace {

constexpr std::chrono::seconds kLookInterval(1);
constexpr std::int64_t kMaxFileBytes = 16 << 20;

}  // namespace

absl::Status FileWatch::ReadAll(Texts& texts) const {
  for (const std::string& path : subject_.paths) {
    ASSIGN_OR_RETURN(auto text, ReadFile(path, kMaxFileBytes));
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
