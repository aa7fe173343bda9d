#include "maps/map_scrubber.hpp"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <utility>

namespace scanloc::server {
namespace {

constexpr int kNicest = 19;

void LetOthersGoFirst() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kNicest);  // of this thread
}

}  // namespace

MapScrubber::MapScrubber(Callbacks callbacks) : callbacks_(std::move(callbacks)) {}

MapScrubber::~MapScrubber() { Stop(); }

void MapScrubber::Stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    has_news_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void MapScrubber::Add(std::shared_ptr<const ServedMap> map) {
  if (map->localizer->map().payload == nullptr) return;
  const std::lock_guard lock(mutex_);
  if (is_stopping_) return;
  waiting_.push_back(std::move(map));
  if (!thread_.joinable()) thread_ = std::thread([this] { Work(); });
  has_news_.notify_all();
}

void MapScrubber::Work() {
  LetOthersGoFirst();
  std::unique_lock lock(mutex_);
  while (true) {
    has_news_.wait(lock, [&] { return is_stopping_ || !waiting_.empty(); });
    if (is_stopping_) return;
    const std::shared_ptr<const ServedMap> map = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    const absl::Status status = map->localizer->map().payload->Scrub([&](std::size_t num_done) {
      callbacks_.progress(*map, num_done);
      const std::lock_guard stopping(mutex_);
      return !is_stopping_ && map.use_count() > 1;
    });
    if (!absl::IsCancelled(status)) callbacks_.done(map, status);
    lock.lock();
  }
}

}  // namespace scanloc::server
