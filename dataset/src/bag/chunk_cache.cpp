#include "bag/chunk_cache.hpp"

#include <algorithm>
#include <cstddef>
#include <system_error>
#include <utility>

#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

// Chunks often hold several clouds, which are asked for one after the other, by a few threads.
constexpr std::size_t kMostChunks = 8;
constexpr std::uint64_t kMostBytes = 256 << 20;
constexpr std::uint64_t kMostBytesAhead = 64 << 20;

}  // namespace

absl::StatusOr<ChunkCache::Records> ChunkCache::Read(std::uint32_t number) const {
  ASSIGN_OR_RETURN(FileBytes read, read_(number));
  return std::make_shared<const FileBytes>(std::move(read));
}

ChunkCache::Entries::iterator ChunkCache::Find(std::uint32_t number) {
  return std::ranges::find(entries_, number, &Entry::number);
}

ChunkCache::Entries ChunkCache::TakeOutOldest() {
  Entries taken;
  std::uint64_t num_bytes = 0;
  for (const Entry& entry : entries_) num_bytes += entry.num_bytes;
  // The newest stays, however large: its messages are asked for one by one.
  while (entries_.size() > kMostChunks || (num_bytes > kMostBytes && entries_.size() > 1)) {
    num_bytes -= entries_.back().num_bytes;
    taken.push_back(std::move(entries_.back()));
    entries_.pop_back();
  }
  return taken;
}

absl::StatusOr<ChunkCache::Records> ChunkCache::Get(std::uint32_t number, std::uint64_t num_bytes) {
  std::shared_future<absl::StatusOr<Records>> records;
  Entries taken;
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = Find(number); known != entries_.end()) {
      records = known->records;
      known->was_got = true;
    } else {
      // Read by who waits for it first.
      records = std::async(std::launch::deferred, [this, number] { return Read(number); }).share();
      entries_.push_front({number, num_bytes, records, true});
      taken = TakeOutOldest();
    }
  }
  absl::StatusOr<Records> got = records.get();
  // What is damaged stays so, for each of the messages in it.
  if (got.ok() || absl::IsDataLoss(got.status())) return got;
  const std::lock_guard lock(mutex_);
  if (const auto failed = Find(number); failed != entries_.end()) {
    entries_.erase(failed);
  }
  return got;
}

bool ChunkCache::WasGot(std::uint32_t number) const {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(
      entries_, [&](const Entry& entry) { return entry.number == number && entry.was_got; });
}

void ChunkCache::ReadAhead(std::uint32_t number, std::uint64_t num_bytes) {
  if (num_bytes > kMostBytesAhead) return;
  Entries taken;
  const std::lock_guard lock(mutex_);
  if (Find(number) != entries_.end()) return;
  try {
    entries_.push_front(
        {number, num_bytes,
         std::async(std::launch::async, [this, number] { return Read(number); }).share(), false});
  } catch (const std::system_error&) {
    return;  // no thread is to be had: who asks for it will read it
  }
  taken = TakeOutOldest();
}

}  // namespace scanloc::dataset
