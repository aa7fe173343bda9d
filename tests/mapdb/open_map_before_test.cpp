// Maps opened beside the one that they take the place of.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scanloc/core/localizer.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/same_answer.hpp"
#include "support/small_maps.hpp"
#include "support/sql.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::size_t kNumPlaces = 1960;
/// With so many contexts a place, and the first scan of that seed, these have one full block of
/// keys, which ends at place 1940.
constexpr std::uint32_t kSeed = 7486;

Params ManyShifts() {
  Params params = test::SmallParams();
  params.cart.enabled = false;
  params.structure.enabled = false;
  for (int i = 2; i < 16; ++i) params.polar.root_shifts_m.push_back(0.5 * i);
  return params;
}

class OpenMapBeforeTest : public testing::Test {
 protected:
  void SetUp() override { Build(path_, test::SmallLoader(kSeed)); }

  static void Build(const std::string& path, const ScanLoader& load) {
    BuildOptions options = test::SmallOptions(path);
    options.params = ManyShifts();
    options.commit_interval = 1000;
    ASSERT_TRUE(BuildMap(options, test::SmallPlan("one", kNumPlaces), load).ok());
  }

  static std::shared_ptr<const Localizer> LocalizerOf(absl::StatusOr<Map> map,
                                                      const Localizer* before = nullptr) {
    EXPECT_TRUE(map.ok()) << map.status();
    return *Localizer::Create(std::make_shared<const Map>(*std::move(map)), nullptr, before);
  }

  static const std::vector<std::shared_ptr<const KeyBlock>>& BlocksOf(const Localizer& localizer) {
    return localizer.map().polar.key_blocks().full();
  }

  static void ExpectSameAnswers(const Localizer& a, const Localizer& b) {
    Describer describer = *Describer::Create(ManyShifts());
    for (const char* method : {"a-pc", "pc-brute"}) {
      const Query query{.method = *ParseMethod(method), .num_candidates = 10, .max_answers = 5};
      for (std::uint32_t i = 0; i < kNumPlaces + 60; i += 397) {
        const ScanDescriptor scan = describer.Describe(test::SmallScan(kSeed + i));
        const auto answer = a.Localize(scan, query);
        ASSERT_TRUE(answer.ok()) << answer.status();
        test::ExpectSameAnswer(*answer, *b.Localize(scan, query));
      }
    }
  }

  test::TempDir dir_;
  std::string path_ = dir_.File("a.scanloc");
};

TEST_F(OpenMapBeforeTest, HoldsTheKeysOfAMapThatWasAppendedToOnce) {
  const auto before = LocalizerOf(OpenMap(path_));
  ASSERT_EQ(BlocksOf(*before).size(), 1U);
  BuildOptions options = test::SmallOptions(path_, BuildMode::kAppend);
  options.params = ManyShifts();
  ASSERT_TRUE(BuildMap(options, test::SmallPlan("two", 60), test::SmallLoader(50'000)).ok());

  const auto anew = LocalizerOf(OpenMap(path_));
  const auto after = LocalizerOf(OpenMap(path_, {.before = &before->map()}), before.get());
  EXPECT_EQ(after->map().places.size(), kNumPlaces + 60);
  EXPECT_EQ(BlocksOf(*after), BlocksOf(*before));
  EXPECT_NE(BlocksOf(*anew), BlocksOf(*before));
  ExpectSameAnswers(*after, *anew);
}

TEST_F(OpenMapBeforeTest, DoesNotHoldKeysOfAnother) {
  const auto before = LocalizerOf(OpenMap(path_));
  const std::string other = dir_.File("b.scanloc");
  Build(other, [](std::size_t scan) -> absl::StatusOr<PointCloud> {
    return test::SmallScan(scan == 7 ? 90'000 : kSeed + static_cast<std::uint32_t>(scan));
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
