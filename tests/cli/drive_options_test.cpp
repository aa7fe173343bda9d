#include "cli/drive_options.hpp"

#include <gtest/gtest.h>

#include <filesystem>

namespace scanloc::cli {
namespace {

TEST(Select, TakesEveryNthWithinTheBounds) {
  const std::vector<int> items = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  using Items = std::vector<int>;
  EXPECT_EQ(*Select(ScanSelection{}, items), items);
  EXPECT_EQ(*Select(ScanSelection{.from = 7}, items), Items({7, 8, 9}));
  EXPECT_EQ(*Select(ScanSelection{.from = 2, .to = 3}, items), Items({2, 3}));
  EXPECT_EQ(*Select(ScanSelection{.every = 4, .offset = 1}, items), Items({1, 5, 9}));
  EXPECT_EQ(*Select(ScanSelection{.from = 2, .every = 4, .offset = 1}, items), Items({5, 9}));
  EXPECT_EQ(*Select(ScanSelection{.to = 1000}, items), items);
}

TEST(Select, RefusesToTakeNothing) {
  const std::vector<int> items = {0, 1, 2};
  EXPECT_EQ(Select(ScanSelection{.from = 3}, items).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(DefaultSessionName, IsThatOfTheDrivesFolder) {
  EXPECT_EQ(DefaultSessionName("/data/monday"), "monday");
  EXPECT_EQ(DefaultSessionName("/data/monday/"), "monday");
  EXPECT_EQ(DefaultSessionName("/data/00/velodyne"), "00");
  EXPECT_EQ(DefaultSessionName("/data/00/velodyne/"), "00");
  EXPECT_EQ(DefaultSessionName("/data/monday/../tuesday"), "tuesday");
  EXPECT_EQ(DefaultSessionName("/velodyne"), "session");
  EXPECT_EQ(DefaultSessionName("/"), "session");
  EXPECT_EQ(DefaultSessionName("."), std::filesystem::current_path().filename().string());
}

}  // namespace
}  // namespace scanloc::cli
