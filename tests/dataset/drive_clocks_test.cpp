// Drives whose scans and poses have stamps that cannot be relied on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "scanloc/dataset/drive.hpp"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::TempDir;
using ::testing::AllOf;
using ::testing::HasSubstr;

// At x along the way.
std::string TumRow(double stamp_s, double x_m) {
  return absl::StrCat(stamp_s, " ", x_m, " 0 0 0 0 0 1\n");
}

void WriteScan(const TempDir& dir, int second) {
  dir.Write(absl::StrCat(second, ".0.bin"), test::KittiBytes(test::SomePoints(3)));
}

absl::Status Opened(const TempDir& dir, const std::string& poses) {
  return OpenDrive({.scans_dir = dir.path().string(), .poses_file = dir.Write("poses.txt", poses)})
      .status();
}

TEST(OpenDrive, RefusesPosesOfOneTimeThatDiffer) {
  const TempDir dir;
  WriteScan(dir, 1);
  WriteScan(dir, 2);
  const std::string rows = TumRow(1, 0) + TumRow(2, 5) + TumRow(2, 5.9);
  EXPECT_TRUE(Opened(dir, rows).ok());
  const absl::Status status = Opened(dir, rows + TumRow(2, 6.1));
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("poses 2 and 4 have the same stamp, 2.000000000 s, but lie 1.10 m"));
}

// GPS time, say, beside UTC: the first poses lie at the times of the last scans.
TEST(OpenDrive, RefusesStampsThatMeetAtTheirEndsOnly) {
  const TempDir dir;
  std::string poses;
  std::string later;
  for (int second = 10; second < 30; ++second) {
    WriteScan(dir, second);
    absl::StrAppend(&poses, TumRow(second, second));
    absl::StrAppend(&later, TumRow(second + 18, second + 18));
  }
  const absl::Status status = Opened(dir, later);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("of 10.000 to 29.000 s"), HasSubstr("of 28.000 to 47.000 s"),
                    HasSubstr("1.0 s in common")));
  // Poses of a longer time, or of a part of it, are none of that.
  EXPECT_TRUE(Opened(dir, poses + later).ok());
  EXPECT_TRUE(Opened(dir, TumRow(28, 1) + TumRow(29, 2)).ok());
}

}  // namespace
}  // namespace scanloc::dataset
