// Chunks of a file that are read once, and ahead of who will want them.
#include "bag/chunk_cache.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "bag/spare_memory.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::uint64_t kSmall = 1000;

FileBytes Bytes(std::uint32_t number) {
  std::unique_ptr<char[]> data(new char[1]);
  data[0] = static_cast<char>(number);
  return {std::move(data), 1};
}

TEST(ChunkCache, ReadsAheadOnAnotherThreadAndOnce) {
  std::atomic<int> num_reads = 0;
  std::thread::id reader;
  ChunkCache cache([&](std::uint32_t number) -> absl::StatusOr<FileBytes> {
    ++num_reads;
    reader = std::this_thread::get_id();
    return Bytes(number);
  });
  cache.ReadAhead(7, kSmall);
  EXPECT_FALSE(cache.WasGot(7));
  const auto got = cache.Get(7, kSmall);
  ASSERT_TRUE(got.ok()) << got.status();
  EXPECT_EQ((*got)->view(), "\7");
  EXPECT_TRUE(cache.WasGot(7));
  EXPECT_NE(reader, std::this_thread::get_id());
  cache.ReadAhead(7, kSmall);
  EXPECT_TRUE(cache.Get(7, kSmall).ok());
  EXPECT_EQ(num_reads, 1);
  // What nobody may ask for is not worth so much memory.
  cache.ReadAhead(8, 1 << 30);
  EXPECT_TRUE(cache.Get(8, kSmall).ok());
  EXPECT_EQ(reader, std::this_thread::get_id());
}

TEST(ChunkCache, TellsAnErrorToWhoAsksAndTriesAgain) {
  std::atomic<bool> fails = true;
  ChunkCache cache([&](std::uint32_t number) -> absl::StatusOr<FileBytes> {
    if (fails) return absl::InvalidArgumentError("damaged");
    return Bytes(number);
  });
  cache.ReadAhead(1, kSmall);
  EXPECT_EQ(cache.Get(1, kSmall).status(), absl::InvalidArgumentError("damaged"));
  EXPECT_EQ(cache.Get(2, kSmall).status(), absl::InvalidArgumentError("damaged"));
  fails = false;
  EXPECT_TRUE(cache.Get(1, kSmall).ok());
  EXPECT_TRUE(cache.Get(2, kSmall).ok());
}

TEST(ChunkCache, ReadsWhatIsDamagedOnce) {
  int num_reads = 0;
  ChunkCache cache([&](std::uint32_t) -> absl::StatusOr<FileBytes> {
    ++num_reads;
    return absl::DataLossError("damaged");
  });
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(cache.Get(1, kSmall).status(), absl::DataLossError("damaged"));
  }
  EXPECT_EQ(num_reads, 1);
}

TEST(ChunkCache, ReadsAChunkOnceHoweverLargeItIs) {
  int num_reads = 0;
  ChunkCache cache([&](std::uint32_t number) -> absl::StatusOr<FileBytes> {
    ++num_reads;
    return Bytes(number);
  });
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(cache.Get(1, 1 << 30).ok());
  EXPECT_EQ(num_reads, 1);
}

TEST(ChunkCache, EndsWithWhatIsReadAhead) {
  std::atomic<int> num_begun = 0;
  std::atomic<int> num_ended = 0;
  {
    ChunkCache cache([&](std::uint32_t number) -> absl::StatusOr<FileBytes> {
      ++num_begun;
      std::this_thread::yield();
      ++num_ended;
      return Bytes(number);
    });
    for (std::uint32_t i = 0; i < 20; ++i) cache.ReadAhead(i, kSmall);  // more than are kept
  }
  EXPECT_EQ(num_begun, 20);
  EXPECT_EQ(num_ended, 20);
}

TEST(ChunkCache, ServesManyThreads) {
  std::array<std::atomic<int>, 100> num_reads{};
  ChunkCache cache([&](std::uint32_t number) -> absl::StatusOr<FileBytes> {
    ++num_reads[number];
    return Bytes(number);
  });
  std::vector<std::jthread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (std::uint32_t i = 0; i < num_reads.size(); ++i) {
        if (i + 1 < num_reads.size()) cache.ReadAhead(i + 1, kSmall);
        const auto got = cache.Get(i, kSmall);
        ASSERT_TRUE(got.ok());
        EXPECT_EQ((*got)->view(), std::string(1, static_cast<char>(i)));
      }
    });
  }
  threads.clear();
  for (const std::atomic<int>& reads : num_reads) EXPECT_GE(reads, 1);
}

TEST(SpareMemory, GivesTheSameMemoryAgain) {
  auto memory = std::make_shared<SpareMemory>();
  ByteArray first = memory->Take(5 << 20);
  const char* const at = first.get();
  first.reset();
  ByteArray smaller = memory->Take(4 << 20);
  EXPECT_EQ(smaller.get(), at);
  ByteArray other = memory->Take(4 << 20);
  EXPECT_NE(other.get(), at);
  other.get()[(4 << 20) - 1] = 'x';
  EXPECT_NE(memory->Take(0), nullptr);
  memory.reset();
  smaller.get()[0] = 'x';  // outlives what it came from
}

}  // namespace
}  // namespace scanloc::dataset
