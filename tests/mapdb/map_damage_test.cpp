// Damage of every kind at every place of a small map: the answer is an error or what was written.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <random>
#include <stdexcept>
#include <string>

#include "map_writer.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/map_equality.hpp"
#include "support/small_maps.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::size_t kPageBytes = 8192;
#ifdef SCANLOC_SANITIZED
constexpr std::size_t kStride = 5;  // every byte takes minutes under a sanitizer
#else
constexpr std::size_t kStride = 1;
#endif

// A map file whose bytes can be changed in place.
class MapDamage : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(test::BuildSmallMap(path_, 3).ok());
    auto writer = MapWriter::Open(path_);
    ASSERT_TRUE(writer.ok()) << writer.status();
    ASSERT_TRUE(
        writer->ReplaceCalibration({{-8.5, 12.25, 30.125, 77}, {{0, 2, 0.75}, {1, 2, 0.5}}}).ok());
    ASSERT_TRUE(writer->Release().ok());
    bytes_ = test::ReadFile(path_);
    const auto map = LoadMap(path_);
    const auto info = ReadInfo(path_);
    ASSERT_TRUE(map.ok() && info.ok());
    map_ = *map;
    info_ = *info;
    file_ = open(path_.c_str(), O_WRONLY | O_CLOEXEC);
    ASSERT_GE(file_, 0);
  }
  void TearDown() override { close(file_); }

  void Put(std::size_t offset, const std::string& bytes) const {
    if (pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset)) !=
        static_cast<ssize_t>(bytes.size())) {
      throw std::runtime_error("cannot write the map");
    }
  }
  void Truncate(std::size_t size) const {
    if (ftruncate(file_, static_cast<off_t>(size)) != 0) throw std::runtime_error("ftruncate");
  }
  void Restore() const {
    Truncate(bytes_.size());
    Put(0, bytes_);
  }

  // Counts what LoadMap and ReadInfo say, and fails if one says something else than was written.
  void CheckAnswers(const std::string& what) {
    const auto map = LoadMap(path_);
    if (map.ok()) {
      ASSERT_TRUE(test::SameMap(*map, map_)) << what;
      ++num_loaded_;
    } else {
      ++num_refused_;
      ASSERT_FALSE(map.status().message().empty()) << what;
    }
    const auto info = ReadInfo(path_);
    ASSERT_TRUE(!info.ok() || test::SameInfo(*info, info_)) << what;
  }

  test::TempDir dir_;
  std::string path_ = dir_.File("a.scanloc");
  std::string bytes_;
  Map map_;
  FileInfo info_;
  int file_ = -1;
  int num_loaded_ = 0;
  int num_refused_ = 0;
};

TEST_F(MapDamage, EveryFlippedByteIsNoticedOrWithoutEffect) {
  for (std::size_t i = 0; i < bytes_.size(); i += kStride) {
    // One bit where SQLite keeps its structures thin, all bits where it keeps nothing.
    const auto flip = static_cast<char>(i % 2 == 0 ? 1 << (i / 2 % 8) : 0xff);
    Put(i, std::string(1, static_cast<char>(bytes_[i] ^ flip)));
    CheckAnswers("byte " + std::to_string(i));
    Put(i, std::string(1, bytes_[i]));
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(num_refused_, 1000 / static_cast<int>(kStride));
  EXPECT_GT(num_loaded_, 1000 / static_cast<int>(kStride));
}

TEST_F(MapDamage, EveryBitOfTheFirstPageIsNoticedOrWithoutEffect) {
  const std::size_t schema_start = bytes_.find("CREATE TABLE", 0);
  for (std::size_t i = 0; i < kPageBytes; i += kStride) {
    if (i >= 200 && i < schema_start - 200) continue;  // unused
    for (int bit = 0; bit < 8; ++bit) {
      Put(i, std::string(1, static_cast<char>(bytes_[i] ^ (1 << bit))));
      CheckAnswers("byte " + std::to_string(i) + " bit " + std::to_string(bit));
      if (HasFatalFailure()) return;
    }
    Put(i, std::string(1, bytes_[i]));
  }
}

TEST_F(MapDamage, EveryTruncationIsNoticedOrWithoutEffect) {
  std::size_t stride = 1;
  for (std::size_t size = 0; size < bytes_.size(); size += stride) {
    stride =
        size < kPageBytes || size % kPageBytes < 8 || size % kPageBytes > kPageBytes - 64 ? 1 : 31;
    Truncate(size);
    CheckAnswers("length " + std::to_string(size));
    Restore();
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(num_refused_, 1000 / static_cast<int>(kStride));
}

TEST_F(MapDamage, GarbageInTheMiddleIsNoticedOrWithoutEffect) {
  std::mt19937 random(7);
  for (int round = 0; round < 500; ++round) {
    const std::size_t start = random() % bytes_.size();
    std::string garbage(std::min<std::size_t>(1 + random() % 600, bytes_.size() - start), '\0');
    for (char& byte : garbage) byte = static_cast<char>(random());
    Put(start, garbage);
    CheckAnswers("round " + std::to_string(round));
    Restore();
    if (HasFatalFailure()) return;
  }
}

TEST_F(MapDamage, ExchangedPagesAreNoticed) {
  const std::size_t num_pages = bytes_.size() / kPageBytes;
  for (std::size_t a = 0; a < num_pages; ++a) {
    for (std::size_t b = a + 1; b < num_pages; ++b) {
      Put(a * kPageBytes, bytes_.substr(b * kPageBytes, kPageBytes));
      Put(b * kPageBytes, bytes_.substr(a * kPageBytes, kPageBytes));
      const int num_loaded = num_loaded_;
      CheckAnswers("pages " + std::to_string(a) + " and " + std::to_string(b));
      // Loading passes over keys and bearings.
      EXPECT_TRUE(num_loaded_ == num_loaded || !FindProblems(path_)->empty()) << a << " and " << b;
      Restore();
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_LE(num_loaded_, 1);
}

TEST_F(MapDamage, IsFoundByVerifyWhereverLoadingFinds) {
  for (std::size_t i = 0; i < bytes_.size(); i += 37) {
    Put(i, std::string(1, static_cast<char>(~bytes_[i])));
    if (!LoadMap(path_).ok()) {
      const auto problems = FindProblems(path_);
      EXPECT_TRUE(!problems.ok() || !problems->empty()) << "byte " << i;
    }
    Put(i, std::string(1, bytes_[i]));
  }
  const auto problems = FindProblems(path_);
  ASSERT_TRUE(problems.ok()) << problems.status();
  EXPECT_TRUE(problems->empty()) << problems->front();
}

}  // namespace
}  // namespace scanloc::mapdb
