#include "scanloc/dataset/gnss_fixes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scanloc/dataset/ros_messages.hpp"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using testing::HasSubstr;

TEST(GnssFixes, AreReadByTheNamesOfTheColumnsAndSortedByTime) {
  const test::TempDir dir;
  const auto fixes = ReadGnssFixes(dir.Write("fixes.csv",
                                             "altitude, stamp,quality,longitude,latitude\r\n"
                                             "519.5,1567410202.5,1,11.6,48.2\r\n"
                                             "nan,1567410203.5,0,11.6,48.2\n"
                                             "\n"
                                             "519.0,1567410201.5,1,11.5,48.1\n"));
  ASSERT_TRUE(fixes.ok()) << fixes.status();
  ASSERT_EQ(fixes->size(), 2U);
  EXPECT_EQ((*fixes)[0].stamp_ns, 1567410201'500000000);
  EXPECT_EQ((*fixes)[1].altitude_m, 519.5);
  const auto between = FixAt(*fixes, 1567410202'000000000);
  ASSERT_TRUE(between.has_value());
  EXPECT_DOUBLE_EQ(between->latitude_deg, 48.15);
  EXPECT_DOUBLE_EQ(between->longitude_deg, 11.55);
  EXPECT_TRUE(FixAt(*fixes, 1567410202'500000000).has_value());
  EXPECT_FALSE(FixAt(*fixes, 1567410201'000000000).has_value()) << "before the first";
  EXPECT_FALSE(FixAt(*fixes, 1567410203'000000000).has_value()) << "after the last";
  const std::vector<GnssFix> sparse = {{0, 1.0, 1.0, 0.0}, {3'000'000'000, 1.0, 1.0, 0.0}};
  EXPECT_FALSE(FixAt(sparse, 1'000'000'000).has_value()) << "too long a gap";
}

// As the stamps and values of poses are.
TEST(GnssFixes, AreReadWithStampsOfAnyUnitAndSemicolons) {
  const test::TempDir dir;
  for (const std::string stamp : {"1567410202.5", "1567410202500", "1567410202500000000"}) {
    const auto fixes = ReadGnssFixes(
        dir.Write("fixes.csv", "stamp;latitude;longitude;altitude\n" + stamp + ";48;11;500\n"));
    ASSERT_TRUE(fixes.ok()) << fixes.status();
    EXPECT_EQ(fixes->at(0).stamp_ns, 1567410202'500000000);
  }
}

TEST(GnssFixes, RefusesFilesThatHoldNone) {
  const test::TempDir dir;
  const auto refused = [&](const std::string& text) {
    return std::string(ReadGnssFixes(dir.Write("bad.csv", text)).status().message());
  };
  EXPECT_THAT(refused("time,latitude,longitude,altitude\n"), HasSubstr("no column stamp"));
  EXPECT_THAT(refused("stamp,latitude,longitude,altitude\n1,2,3\n"),
              HasSubstr("bad.csv:2: does not hold stamp [s]"));
  EXPECT_THAT(refused("stamp,latitude,longitude,altitude\n1,2,x,4\n"),
              HasSubstr("bad.csv:2: does not hold stamp [s]"));
  EXPECT_THAT(refused("stamp,latitude,longitude,altitude\n1,95,3,4\n"), HasSubstr("no fix"));
  EXPECT_FALSE(ReadGnssFixes(dir.File("none.csv")).ok());
  EXPECT_FALSE(ReadGnssFixes(dir.Write("bad.mcap", "no bag")).ok());
}

TEST(GnssFixes, AreDecodedFromMessages) {
  const auto message = [](std::int8_t status) {
    std::string bytes;
    test::AppendBytes(bytes, std::uint32_t{7});   // sequence
    test::AppendBytes(bytes, std::uint32_t{12});  // seconds
    test::AppendBytes(bytes, std::uint32_t{5});
    test::AppendBytes(bytes, std::uint32_t{3});
    bytes += "gps";
    test::AppendBytes(bytes, status);
    test::AppendBytes(bytes, std::uint16_t{1});
    for (const double value : {48.1, 11.5, 519.0}) test::AppendBytes(bytes, value);
    return bytes;
  };
  const auto fix = DecodeFix(WireFormat::kRos1, message(0));
  ASSERT_TRUE(fix.ok() && fix->has_value()) << fix.status();
  EXPECT_EQ((*fix)->stamp_ns, 12'000000005);
  EXPECT_EQ((*fix)->longitude_deg, 11.5);
  EXPECT_EQ(*DecodeFix(WireFormat::kRos1, message(-1)), std::nullopt) << "no fix, it says";
  const std::string whole = message(0);
  EXPECT_FALSE(DecodeFix(WireFormat::kRos1, whole.substr(0, whole.size() - 1)).ok());
}

}  // namespace
}  // namespace scanloc::dataset
