#include "name_order.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace scanloc::dataset {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

NameOrder Order(const std::vector<std::string>& names) {
  return OrderNames({names.begin(), names.end()});
}

// Names that are given in the order that they should come in, told without doubt.
void ExpectOrdered(const std::vector<std::string>& names) {
  std::vector<std::string> turned(names.rbegin(), names.rend());
  const NameOrder result = Order(turned);
  std::vector<std::string> ordered;
  for (const std::size_t i : result.order) ordered.push_back(turned[i]);
  EXPECT_EQ(ordered, names);
  EXPECT_EQ(result.doubt, "");
}

TEST(NameOrder, ComparesNumbersAsNumbersWhateverStandsAround) {
  ExpectOrdered({"2.bin", "10.bin", "0011.bin"});
  ExpectOrdered({"full2.pcd", "full10.pcd"});
  ExpectOrdered({"frame_9_end.pcd.bin", "frame_10_end.pcd.bin"});
  ExpectOrdered({"cloud_1583836591_85000000.ply", "cloud_1583836591_170000000.ply",
                 "cloud_1583836592_5000000.ply"});
  ExpectOrdered({"a-9-2.bin", "a-9-10.bin", "a-10-1.bin"});
  ExpectOrdered({"1.000001.bin", "1.000002.bin", "1.100000.bin"});
}

TEST(NameOrder, TellsFractionsFromWholeNanoseconds) {
  ExpectOrdered({"17.05.bin", "17.5.bin", "18.25.bin"});
  ExpectOrdered({"17.37000000.bin", "17.137000000.bin", "18.5000000.bin"});
  std::vector<std::string> many;
  for (int i = 0; i < 60; ++i) many.push_back(absl::StrCat(17, ".", 36999941 + 14000000 * i));
  for (std::string& name : many) name += ".bin";
  ExpectOrdered(many);
  EXPECT_THAT(Order({"17.36999941.bin", "17.136999941.bin"}).doubt, HasSubstr("lengths"));
  EXPECT_THAT(Order({"17.36999941.bin", "17.136999941.bin"}).stamps_ns, IsEmpty());
}

TEST(NameOrder, DoubtsNumbersInNamesOfSeveralShapes) {
  EXPECT_THAT(Order({"scan9.bin", "scan10.bin", "last.bin"}).doubt,
              HasSubstr("scan9.bin comes before scan10.bin"));
  ExpectOrdered({"B.bin", "a.bin", "a1.bin", "b.pcd", "c.PLY"});
}

TEST(NameOrder, ReadsStamps) {
  EXPECT_THAT(Order({"1567410201000000000.bin"}).stamps_ns, ElementsAre(1567410201000000000));
  EXPECT_THAT(Order({"1305031102175304.bin"}).stamps_ns, ElementsAre(1305031102175304000));
  EXPECT_THAT(Order({"2.5.bin", "1.0.bin"}).stamps_ns, ElementsAre(1000000000, 2500000000));
  EXPECT_THAT(Order({"cloud_1305031102.175304.pcd"}).stamps_ns, ElementsAre(1305031102175304000));
  EXPECT_THAT(Order({"1741286118.50000000.bin", "1741286117.950000000.bin"}).stamps_ns,
              ElementsAre(1741286117950000000, 1741286118050000000));
  EXPECT_THAT(Order({"c_1741286118_50000001.bin", "c_1741286117_950000000.bin"}).stamps_ns,
              ElementsAre(1741286117950000000, 1741286118050000001));
  // A counter after the seconds is no stamp, and one name without a stamp leaves none.
  EXPECT_THAT(Order({"1741286117_000001.bin", "1741286118_000002.bin"}).stamps_ns, IsEmpty());
  EXPECT_THAT(Order({"1741286117_85000000000.bin"}).stamps_ns, IsEmpty());
  EXPECT_THAT(Order({"1567410201000000000.bin", "2.bin"}).stamps_ns, IsEmpty());
}

TEST(NameOrder, GivesTheOnlyNumberOfEachName) {
  EXPECT_THAT(Order({"f10.bin", "f9.bin"}).numbers, ElementsAre(9, 10));
  EXPECT_THAT(Order({"f1_2.bin", "f1_3.bin"}).numbers, IsEmpty());
  EXPECT_THAT(Order({"f1.bin", "g2.bin"}).numbers, IsEmpty());
}

TEST(NameOrder, TakesWhateverNamesThereAre) {
  EXPECT_THAT(Order({}).order, IsEmpty());
  EXPECT_THAT(Order({"", ".", "..", "9", std::string(300, '7')}).order, SizeIs(5));
}

}  // namespace
}  // namespace scanloc::dataset
