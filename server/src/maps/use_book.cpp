#include "maps/use_book.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/mapdb/use_file.hpp"
#include "scanloc/proto/convert_viewer.hpp"

namespace scanloc::server {
namespace {

std::string SetAside(const std::string& file) { return absl::StrCat(file, ".old"); }

}  // namespace

UseCounter::UseCounter(std::string file, std::string content_id, std::int64_t num_places,
                       std::shared_ptr<UseCounter> before)
    : file_(std::move(file)),
      content_id_(std::move(content_id)),
      num_places_(num_places),
      before_(std::move(before)) {
  use_.content_id = content_id_;
}

void UseCounter::Load() {
  std::call_once(loaded_, [this] {
    if (before_ != nullptr) {
      before_->Write();
      before_->Close();
      before_.reset();
    }
    const std::lock_guard writing(writing_);
    ReadFile();
    known_ = Look();
  });
}

void UseCounter::ReadFile() {
  absl::StatusOr<MapUse> found = mapdb::ReadUse(file_, num_places_);
  if (found.ok() && found->content_id == content_id_) {
    const std::lock_guard lock(mutex_);
    use_ = *std::move(found);
    return;
  }
  if (absl::IsNotFound(found.status())) return;
  const std::string why = found.ok() ? absl::StrCat("it is of content ", found->content_id)
                                     : absl::StrCat(found.status().message());
  absl::StatusOr<MapUse> old = mapdb::ReadUse(SetAside(file_), num_places_);
  const bool is_taken_up = old.ok() && old->content_id == content_id_;
  if (is_taken_up) {
    const std::lock_guard lock(mutex_);
    use_ = *std::move(old);
    is_changed_ = true;
  }
  if (std::rename(file_.c_str(), SetAside(file_).c_str()) != 0) {
    spdlog::warn(
        "the health of map content {} is counted anew, and not kept: {}, and cannot be set "
        "aside: {}",
        content_id_, why, std::strerror(errno));
    is_closed_ = true;
    return;
  }
  spdlog::warn("'{}' is set aside as '{}', and the health of map content {} is {}: {}", file_,
               SetAside(file_), content_id_,
               is_taken_up ? "taken up from where it was" : "counted anew", why);
}

std::optional<UseCounter::FileState> UseCounter::Look() const {
  struct stat about = {};
  if (stat(file_.c_str(), &about) != 0) return std::nullopt;
  return FileState{about.st_dev, about.st_ino,
                   about.st_mtim.tv_sec * 1'000'000'000LL + about.st_mtim.tv_nsec};
}

void UseCounter::Count(const Answer& answer, std::optional<std::int32_t> last_found,
                       std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  scanloc::Count(answer, last_found, now_ns, use_);
  is_changed_ = true;
}

absl::StatusOr<PlaceUsePage> UseCounter::Page(std::int32_t first_place, int max_places) const {
  const std::lock_guard lock(mutex_);
  return PageOfUse(use_, first_place, max_places);
}

void UseCounter::Close() {
  const std::lock_guard lock(writing_);
  is_closed_ = true;
}

void UseCounter::Write() {
  const std::lock_guard writing(writing_);
  if (is_closed_) return;
  MapUse use;
  {
    const std::lock_guard lock(mutex_);
    if (!std::exchange(is_changed_, false)) return;
    use = use_;
  }
  if (const auto now = Look(); now && now != known_) {
    spdlog::warn(
        "'{}' was written by another program, and is left to it: each server needs a "
        "folder of its own for its maps, or --map-health-seconds 0",
        file_);
    is_closed_ = true;
    return;
  }
  if (auto status = mapdb::WriteUse(file_, use); !status.ok()) {
    if (!std::exchange(is_told_, true)) {
      spdlog::warn("the health of map content {} is counted, but not kept over a restart: {}",
                   content_id_, absl::StrCat(status.message()));
    }
    const std::lock_guard lock(mutex_);
    is_changed_ = true;
    return;
  }
  if (std::exchange(is_told_, false)) spdlog::info("'{}' is kept again", file_);
  known_ = Look();
}

UseBook::UseBook(std::chrono::duration<double> period) : period_(period) {}

UseBook::~UseBook() { Stop(); }

std::shared_ptr<UseCounter> UseBook::Open(const std::string& map_path,
                                          const std::string& content_id, std::int64_t num_places) {
  const std::shared_ptr<UseCounter> counter = [&]() -> std::shared_ptr<UseCounter> {
    const std::lock_guard lock(mutex_);
    if (period_.count() <= 0.0 || is_stopping_) return nullptr;
    const std::string file = mapdb::UseFileOf(map_path);
    const auto known =
        std::ranges::find_if(counters_, [&](const auto& other) { return other->file() == file; });
    if (known != counters_.end()) {
      if ((*known)->content_id() != content_id) {
        *known = std::make_shared<UseCounter>(file, content_id, num_places, std::move(*known));
      }
      return *known;
    }
    counters_.push_back(std::make_shared<UseCounter>(file, content_id, num_places));
    if (!thread_.joinable()) thread_ = std::thread([this] { Work(); });
    return counters_.back();
  }();
  if (counter != nullptr) counter->Load();
  return counter;
}

void UseBook::Stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    wakes_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
  WriteAll();
}

void UseBook::Work() {
  std::unique_lock lock(mutex_);
  while (!wakes_.wait_for(lock, period_, [this] { return is_stopping_; })) {
    lock.unlock();
    WriteAll();
    lock.lock();
  }
}

void UseBook::WriteAll() {
  std::vector<std::shared_ptr<UseCounter>> counters;
  {
    const std::lock_guard lock(mutex_);
    counters = counters_;
  }
  for (const auto& counter : counters) counter->Write();
  counters.clear();
  // What only this book still holds is of a map out of service. It is written whole: nobody counts.
  const std::lock_guard lock(mutex_);
  std::erase_if(counters_, [](const auto& counter) {
    if (counter.use_count() > 1) return false;
    counter->Write();
    return true;
  });
}

}  // namespace scanloc::server
