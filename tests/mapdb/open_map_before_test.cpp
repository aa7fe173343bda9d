// Maps opened beside the one that they take the place of.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scanloc/core/localizer.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/full_block.hpp"
#include "support/sql.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using test::BlocksOf;
using test::ExpectSameAnswers;

class OpenMapBeforeTest : public testing::Test {
 protected:
  void SetUp() override { test::BuildFullBlock(path_); }

  static std::shared_ptr<const Localizer> LocalizerOf(absl::StatusOr<Map> map,
                                                      const Localizer* before = nullptr) {
    EXPECT_TRUE(map.ok()) << map.status();
    return *Localizer::Create(std::make_shared<const Map>(*std::move(map)), nullptr, before);
  }

  test::TempDir dir_;
  std::string path_ = dir_.File("a.scanloc");
};

TEST_F(OpenMapBeforeTest, HoldsTheKeysOfAMapThatWasAppendedToOnce) {
  const auto before = LocalizerOf(OpenMap(path_));
  ASSERT_EQ(BlocksOf(*before).size(), 1U);
  test::AppendToFullBlock(path_);

  const auto anew = LocalizerOf(OpenMap(path_));
  const auto after = LocalizerOf(OpenMap(path_, {.before = &before->map()}), before.get());
  EXPECT_EQ(after->map().places.size(), test::kFullBlockPlaces + 60);
  EXPECT_EQ(BlocksOf(*after), BlocksOf(*before));
  EXPECT_NE(BlocksOf(*anew), BlocksOf(*before));
  ExpectSameAnswers(*after, *anew);
}

TEST_F(OpenMapBeforeTest, DoesNotHoldKeysOfAnother) {
  const auto before = LocalizerOf(OpenMap(path_));
  const std::string other = dir_.File("b.scanloc");
  test::BuildFullBlock(other, [](std::size_t scan) -> absl::StatusOr<PointCloud> {
    return test::SmallScan(scan == 7 ? 90'000
                                     : test::kFullBlockSeed + static_cast<std::uint32_t>(scan));
  });
  const auto anew = LocalizerOf(OpenMap(other));
  const auto after = LocalizerOf(OpenMap(other, {.before = &before->map()}), before.get());
  ASSERT_EQ(BlocksOf(*after).size(), 1U);
  EXPECT_NE(BlocksOf(*after), BlocksOf(*before));
  ExpectSameAnswers(*after, *anew);
}

TEST_F(OpenMapBeforeTest, OutlivesTheMapBefore) {
  auto before = LocalizerOf(OpenMap(path_));
  const auto after = LocalizerOf(OpenMap(path_, {.before = &before->map()}), before.get());
  const auto anew = LocalizerOf(OpenMap(path_));
  ASSERT_EQ(BlocksOf(*after), BlocksOf(*before));
  before.reset();
  ExpectSameAnswers(*after, *anew);
}

TEST_F(OpenMapBeforeTest, TellsDamageThatTheMapBeforeDoesNotHave) {
  const auto before = LocalizerOf(OpenMap(path_));
  test::Sql(path_, "UPDATE keys SET retrieval_keys = zeroblob(272) WHERE place = 5");
  const auto after = OpenMap(path_, {.before = &before->map()});
  EXPECT_EQ(after.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(after.status().message()), testing::HasSubstr("keys of place 5"));
}

}  // namespace
}  // namespace scanloc::mapdb
