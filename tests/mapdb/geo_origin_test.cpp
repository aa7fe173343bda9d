#include "scanloc/mapdb/geo_origin.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scanloc/mapdb/edit_map.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/mapdb/merge_maps.hpp"
#include "support/small_maps.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

class GeoOriginTest : public testing::Test {
 protected:
  [[nodiscard]] std::string Small(const std::string& name, std::uint32_t seed) const {
    EXPECT_TRUE(test::BuildSmallMap(dir_.File(name), 4, name, seed).ok());
    return dir_.File(name);
  }
  static std::optional<GeoOrigin> Of(const std::string& map) {
    const auto info = ReadInfo(map);
    EXPECT_TRUE(info.ok()) << info.status();
    return info.ok() ? info->geo_origin : std::nullopt;
  }

  const test::TempDir dir_;
  const GeoOrigin munich_{48.137412345678901, 11.5755, 519.25, 31.5, {1.0e7, -2.0 / 3.0, 0.0}};
};

TEST_F(GeoOriginTest, IsKeptToTheLastBitBesideTheContent) {
  const std::string map = Small("map", 1);
  const std::string before = ReadInfo(map)->content_id;
  EXPECT_EQ(Of(map), std::nullopt);
  ASSERT_TRUE(SetGeoOrigin(map, {1.0, 2.0, 3.0}).ok());
  ASSERT_TRUE(SetGeoOrigin(map, munich_).ok());  // once more
  EXPECT_EQ(Of(map), munich_);
  EXPECT_EQ(ReadInfo(map)->content_id, before);
  EXPECT_TRUE(FindProblems(map)->empty());
}

TEST_F(GeoOriginTest, GoesAlongUnlessTheMapIsMoved) {
  const std::string map = Small("map", 1);
  ASSERT_TRUE(SetGeoOrigin(map, munich_).ok());
  ASSERT_TRUE(EditMap(map, dir_.File("renamed"), {RenameSession{"map", "new"}}, {}).ok());
  EXPECT_EQ(Of(dir_.File("renamed")), munich_);
  ASSERT_TRUE(EditMap(map, dir_.File("moved"), {Transform{Pose::Identity()}}, {}).ok());
  EXPECT_EQ(Of(dir_.File("moved")), std::nullopt);
}

TEST_F(GeoOriginTest, MustBeOneWhereMapsAreMerged) {
  const std::string one = Small("one", 1);
  const std::string two = Small("two", 50);
  ASSERT_TRUE(SetGeoOrigin(two, munich_).ok());
  ASSERT_TRUE(MergeMaps(dir_.File("both"), {one, two}).ok());
  EXPECT_EQ(Of(dir_.File("both")), munich_);
  ASSERT_TRUE(SetGeoOrigin(one, {1.0, 2.0, 3.0}).ok());
  const absl::Status status = MergeMaps(dir_.File("none"), {one, two}).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("geo origins"));
}

TEST_F(GeoOriginTest, RefusesWhatIsNone) {
  const std::string map = Small("map", 1);
  EXPECT_TRUE(absl::IsInvalidArgument(SetGeoOrigin(map, {91.0, 0.0, 0.0})));
  EXPECT_FALSE(SetGeoOrigin(dir_.File("no such map"), munich_).ok());
  for (const char* text :
       {"", "1 2 3", "1 2 3 4 5 6 x", "1 2 3 4 5 6 7 8", "nan 2 3 4 5 6 7", "1 2 1e300 4 5 6 7"}) {
    EXPECT_FALSE(DecodeGeoOrigin(text).ok()) << text;
  }
  EXPECT_EQ(*DecodeGeoOrigin(EncodeGeoOrigin(munich_)), munich_);
}

}  // namespace
}  // namespace scanloc::mapdb
