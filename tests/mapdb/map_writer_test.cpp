#include "map_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "open_map.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/small_maps.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(MapWriter, TellsOfAReaderThatKeepsTheFileBusy) {
  const test::TempDir dir;
  const std::string path = dir.File("a.scanloc");
  const auto built = test::BuildSmallMap(path, 4);
  ASSERT_TRUE(built.ok()) << built.status();
  const auto reader = OpenForReading(path);
  ASSERT_TRUE(reader.ok()) << reader.status();
  auto writer = MapWriter::Open(path);
  ASSERT_TRUE(writer.ok()) << writer.status();
  writer->SetReadersTimeout(1);
  const absl::Status status = writer->StartSession(test::SmallPlan("two", 1));
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("has been reading it"));
  EXPECT_THAT(std::string(status.message()), Not(HasSubstr("another build")));
}

TEST(MapFile, SaysThatItIsHalfBuilt) {
  const test::TempDir dir;
  const std::string path = dir.File("a.scanloc");
  const auto builder = MapBuilder::Create(path, test::SmallParams(), test::SmallPlan("one", 3));
  ASSERT_TRUE(builder.ok()) << builder.status();
  EXPECT_FALSE(LoadMap(path)->complete);
  EXPECT_FALSE(ReadInfo(path)->complete);
}

// Two files of one content id answer alike only with one calibration.
TEST(MapFile, NamesItsCalibration) {
  const test::TempDir dir;
  const std::string path = dir.File("a.scanloc");
  ASSERT_TRUE(test::BuildSmallMap(path, 4).ok());
  std::vector<std::string> ids = {LoadMap(path)->calibration_id};
  EXPECT_EQ(ids[0], "");
  for (const double bias : {-8.5, -9.5}) {
    auto writer = MapWriter::Open(path);
    ASSERT_TRUE(writer.ok()) << writer.status();
    ASSERT_TRUE(writer->ReplaceCalibration({{bias, 12.25, 30.125, 77}, {{0, 2, 0.75}}}).ok());
    ASSERT_TRUE(writer->Release().ok());
    ids.push_back(LoadMap(path)->calibration_id);
    EXPECT_EQ(ids.back().size(), 16U);
    EXPECT_EQ(ReadInfo(path)->calibration_id, ids.back());
  }
  EXPECT_NE(ids[1], ids[2]);
}

}  // namespace
}  // namespace scanloc::mapdb
