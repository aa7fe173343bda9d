#include "rpc/query_describer.hpp"

#include <gtest/gtest.h>

#include <string>

#include "scanloc/proto/convert.hpp"

namespace scanloc::server {
namespace {

constexpr std::int64_t kMiB = std::int64_t{1} << 20;

/// A scan of num_layers times 10,000 voxels.
v1::LocalizeRequest ScanOf(int num_layers) {
  PointCloud scan;
  for (int z = 0; z < num_layers; ++z) {
    for (int i = 0; i < 10'000; ++i) {
      scan.push_back({0.5F * static_cast<float>(i % 100) - 24.75F,
                      0.5F * static_cast<float>(i / 100) - 24.75F,
                      0.5F * static_cast<float>(z) - 1.75F});
    }
  }
  v1::LocalizeRequest request;
  *request.mutable_scan() = proto::ToProto(scan);
  return request;
}

/// What is held after a scan to a map of that signature.
std::int64_t HeldAfter(QueryDescriber& describer, const v1::LocalizeRequest& request,
                       const std::string& signature = "a") {
  ServedMap map;
  map.signature = signature;
  EXPECT_TRUE(describer.Describe(request, map, 2'000'000).ok());
  return describer.held_bytes();
}

TEST(QueryDescriber, KeepsTheTablesOfLargeScansAndGivesBackThoseOfHugeOnes) {
  QueryDescriber describer;
  const v1::LocalizeRequest large = ScanOf(20);
  const std::int64_t held = HeldAfter(describer, large);
  EXPECT_GT(held, 10 * kMiB);
  EXPECT_LE(held, 32 * kMiB);
  EXPECT_EQ(HeldAfter(describer, ScanOf(1)), held);
  EXPECT_EQ(HeldAfter(describer, ScanOf(60)), 0);
  EXPECT_EQ(HeldAfter(describer, large), held);
}

TEST(QueryDescriber, LetsGoOfTheTablesOfOtherMapsFirst) {
  QueryDescriber describer;
  const v1::LocalizeRequest large = ScanOf(20);
  const std::int64_t held = HeldAfter(describer, large);
  for (const char* other : {"b", "c", "d", "e"}) {
    const std::int64_t now = HeldAfter(describer, large, other);
    EXPECT_GE(now, held);
    EXPECT_LE(now, 32 * kMiB);
  }
}

}  // namespace
}  // namespace scanloc::server
