#include "scanloc/mapdb/use_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "absl/strings/str_replace.h"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::int64_t kNumPlaces = 100'001;

MapUse MakeUse() {
  MapUse use{.content_id = "0123abcd",
             .since_ns = 1'700'000'000'000'000'000,
             .until_ns = 1'700'000'000'000'000'009,
             .num_localized = 3,
             .num_ambiguous = 4,
             .num_not_recognized = 5,
             .num_insufficient = 6,
             .num_refused_nowhere = 7};
  use.places[2] = {.num_found = 3,
                   .num_refused = 1,
                   .confidence = 1.0 / 3.0,
                   .disagreement = 0.1,
                   .recent_disagreement = 1e-9,
                   .last_found_ns = 8,
                   .last_refused_ns = 9};
  use.places[100'000] = {.num_refused = 4};
  return use;
}

TEST(UseFile, BringsBackWhatWasWritten) {
  const test::TempDir dir;
  const std::string path = UseFileOf(dir.File("town.scanloc"));
  EXPECT_EQ(path, dir.File("town.scanloc.health"));
  EXPECT_TRUE(absl::IsNotFound(ReadUse(path, kNumPlaces).status()));
  for (const MapUse& use : {MakeUse(), MapUse{.content_id = "another"}}) {
    ASSERT_TRUE(WriteUse(path, use).ok());
    const absl::StatusOr<MapUse> back = ReadUse(path, kNumPlaces);
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_EQ(*back, use);
  }
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

TEST(UseFile, RefusesEveryCutAndEveryChangedByte) {
  const std::string text = EncodeUse(MakeUse());
  ASSERT_TRUE(DecodeUse(text).ok());
  for (std::size_t size = 0; size < text.size(); ++size) {
    EXPECT_FALSE(DecodeUse(text.substr(0, size)).ok()) << size;
  }
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string bad = text;
    bad[i] = bad[i] == '7' ? '8' : '7';
    EXPECT_FALSE(DecodeUse(bad).ok()) << i;
  }
  EXPECT_EQ(DecodeUse(text.substr(0, 60)).status().code(), absl::StatusCode::kDataLoss);
}

TEST(UseFile, TellsForeignAndNewerOnesFromDamage) {
  EXPECT_TRUE(absl::IsInvalidArgument(DecodeUse("SQLite format 3").status()));
  EXPECT_TRUE(absl::IsFailedPrecondition(
      DecodeUse(absl::StrReplaceAll(EncodeUse(MakeUse()), {{"health 1", "health 2"}})).status()));
}

TEST(UseFile, RefusesWhatTheMapHasNoPlacesFor) {
  const test::TempDir dir;
  const std::string path = dir.File("town.scanloc.health");
  ASSERT_TRUE(WriteUse(path, MakeUse()).ok());
  EXPECT_TRUE(absl::IsDataLoss(ReadUse(path, kNumPlaces - 1).status()));
  // Of far more bytes than so many places can have no more are read.
  std::filesystem::resize_file(path, std::uintmax_t{1} << 33);
  EXPECT_TRUE(absl::IsResourceExhausted(ReadUse(path, kNumPlaces).status()));
}

TEST(UseFile, WaitsForNoPipe) {
  const test::TempDir dir;
  ASSERT_EQ(mkfifo(dir.File("pipe").c_str(), 0600), 0);
  EXPECT_TRUE(absl::IsInvalidArgument(ReadUse(dir.File("pipe"), kNumPlaces).status()));
  EXPECT_FALSE(ReadUse(dir.File(""), kNumPlaces).ok());
  EXPECT_FALSE(WriteUse(dir.File("none/town.health"), MakeUse()).ok());
}

}  // namespace
}  // namespace scanloc::mapdb
