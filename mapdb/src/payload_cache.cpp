#include "payload_cache.hpp"

namespace scanloc::mapdb {
namespace {

/// What an entry takes beside its values: nodes of list and map, and the allocations' own.
constexpr std::int64_t kEntryBytes = 256;

std::int64_t BytesOf(const Payload& payload) {
  return kEntryBytes + static_cast<std::int64_t>(sizeof(Payload) +
                                                 payload.cells_cm.size() * sizeof(std::uint16_t) +
                                                 payload.aligning_cm.size() * sizeof(std::int32_t) +
                                                 payload.structure.posts.size() * sizeof(Post));
}

}  // namespace

std::shared_ptr<PayloadCache> MakePayloadCache(std::int64_t max_bytes) {
  return std::make_shared<PayloadCache>(max_bytes);
}

std::int64_t HeldBytes(const PayloadCache& cache) { return cache.held_bytes(); }

std::int64_t PayloadCache::held_bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

std::uint64_t PayloadCache::NewMap() {
  const std::lock_guard lock(mutex_);
  return ++num_maps_;
}

void PayloadCache::Forget(std::uint64_t map) {
  std::list<Entry> dropped;  // freed outside the lock
  const std::lock_guard lock(mutex_);
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    const auto next = std::next(entry);
    if (entry->row.map == map) {
      bytes_ -= entry->bytes;
      at_.erase(entry->row);
      dropped.splice(dropped.end(), entries_, entry);
    }
    entry = next;
  }
}

std::vector<std::shared_ptr<const Payload>> PayloadCache::Find(std::span<const Row> rows) {
  std::vector<std::shared_ptr<const Payload>> payloads(rows.size());
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto found = at_.find(rows[i]);
    if (found == at_.end()) continue;
    const auto entry = found->second;
    if (num_added_ - entry->moved > entries_.size() / 4) {
      entry->moved = num_added_;
      entries_.splice(entries_.begin(), entries_, entry);
    }
    payloads[i] = entry->payload;
  }
  return payloads;
}

void PayloadCache::Add(const Row& row, std::shared_ptr<const Payload> payload) {
  const std::int64_t bytes = BytesOf(*payload);
  if (bytes > max_bytes_) return;
  std::list<Entry> dropped;  // freed outside the lock
  const std::lock_guard lock(mutex_);
  if (at_.contains(row)) return;  // another thread was quicker
  entries_.push_front({row, std::move(payload), bytes, ++num_added_});
  at_[row] = entries_.begin();
  bytes_ += bytes;
  while (bytes_ > max_bytes_) {
    bytes_ -= entries_.back().bytes;
    at_.erase(entries_.back().row);
    dropped.splice(dropped.end(), entries_, std::prev(entries_.end()));
  }
}

}  // namespace scanloc::mapdb
