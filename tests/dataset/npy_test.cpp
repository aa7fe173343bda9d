// NumPy arrays as NAVER LABS publishes its scans: x y z in centimetres.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scan_decoders.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::AppendBytes;
using test::NaverBytes;
using test::NpyBytes;
using test::SomePoints;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

absl::StatusOr<Scan> Decode(std::string_view bytes) { return DecodeNpy(bytes, true); }

std::string Dictionary(const std::string& descr, const std::string& shape,
                       const std::string& fortran_order = "False") {
  return absl::StrCat("{'descr': '", descr, "', 'fortran_order': ", fortran_order,
                      ", 'shape': ", shape, ", }");
}

template <typename Number>
std::string Values(const std::vector<Number>& values) {
  std::string bytes;
  for (const Number value : values) AppendBytes(bytes, value);
  return bytes;
}

template <typename Number>
void ExpectBothOrders(const std::string& descr) {
  SCOPED_TRACE(descr);
  const auto rows = Decode(NpyBytes(Dictionary(descr, "(2, 4)"),
                                    Values<Number>({1000, -200, 50, 7, -30000, 400, 25, 9})));
  const auto columns = Decode(NpyBytes(Dictionary(descr, "(2, 4)", "True"),
                                       Values<Number>({1000, -30000, -200, 400, 50, 25, 7, 9})));
  ASSERT_TRUE(rows.ok()) << rows.status();
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_THAT(rows->points, ElementsAre(Point{10.0F, -2.0F, 0.5F}, Point{-300.0F, 4.0F, 0.25F}));
  EXPECT_EQ(*rows, *columns);
}

TEST(Npy, ReadsTheFourTypesInBothOrdersAsCentimetres) {
  ExpectBothOrders<std::int16_t>("<i2");
  ExpectBothOrders<std::int32_t>("<i4");
  ExpectBothOrders<float>("<f4");
  ExpectBothOrders<double>("<f8");
}

TEST(Npy, ReadsAllThreeVersions) {
  const std::string first = NaverBytes(SomePoints(5));
  const std::string text = first.substr(10);
  for (const char version : {'\x02', '\x03'}) {
    std::string bytes = std::string("\x93NUMPY") + version + '\0';
    AppendBytes(bytes, static_cast<std::uint32_t>(text.find('\n') + 1));
    const auto scan = Decode(bytes + text);
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->points, SomePoints(5));
  }
}

TEST(Npy, LeavesOutBeamsWithoutReturnAndPointsThatAreNotFinite) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto scan = Decode(NpyBytes(Dictionary("<f4", "(4, 3)"),
                                    Values<float>({0, 0, 0, 1000, 0, 0, kNan, 1, 1, 0, -0.0F, 0})));
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_THAT(scan->points, ElementsAre(Point{10.0F, 0.0F, 0.0F}));
  EXPECT_EQ(scan->num_no_return, 2U);
  EXPECT_EQ(scan->num_not_finite, 1U);
}

TEST(Npy, TakesHeadersAsOtherWritersLayThemOut) {
  const std::string values = Values<float>({1000, 2000, 300});
  for (const std::string& dictionary :
       {std::string("{\"shape\":(1,3),\"descr\":\"<f4\",\"fortran_order\":False}"),
        std::string("{ 'fortran_order' : False , 'shape' : ( 1 , 3 , ) , 'descr' : '<f4' , }")}) {
    const auto scan = Decode(NpyBytes(dictionary, values));
    ASSERT_TRUE(scan.ok()) << dictionary << scan.status();
    EXPECT_THAT(scan->points, ElementsAre(Point{10.0F, 20.0F, 3.0F}));
  }
  const auto empty = Decode(NpyBytes(Dictionary("<f4", "(0, 4)"), ""));
  ASSERT_TRUE(empty.ok()) << empty.status();
  EXPECT_TRUE(empty->points.empty());
}

TEST(Npy, RefusesHeadersThatLieOrAreOfAnotherKind) {
  struct Case {
    std::string dictionary;
    std::string reason;
  };
  const std::vector<Case> table = {
      {Dictionary(">f4", "(1, 3)"), "\">f4\""},
      {Dictionary("<u2", "(1, 3)"), "\"<u2\""},
      {Dictionary("|O", "(1, 3)"), "\"|O\""},
      {"{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (1, 3), }", "records"},
      {Dictionary("<f4", "(3,)"), "1 dimensions"},
      {Dictionary("<f4", "()"), "0 dimensions"},
      {Dictionary("<f4", "(1, 1, 3)"), "3 dimensions"},
      {Dictionary("<f4", "(1, 2)"), "2 columns"},
      {Dictionary("<f4", "(1, 5000)"), "5000 columns"},
      {Dictionary("<f4", "(-1, 3)"), "\"-1\""},
      {Dictionary("<f4", "(1, -3)"), "\"-3\""},
      {Dictionary("<f4", "(1.0, 3)"), "\"1.0\""},
      {Dictionary("<f4", "(1 1, 3)"), "\"1 1\""},
      {Dictionary("<f4", "(2, 3)"), "24 bytes of values, but 12 follow"},
      {Dictionary("<f4", "(4000001, 3)"), "4000001 points"},
      {Dictionary("<f4", "(18446744073709551615, 3)"), "18446744073709551615 points"},
      {Dictionary("<f4", "(4611686018427387905, 4)"), "4611686018427387905 points"},
      {Dictionary("<f4", "(1, 18446744073709551615)"), "columns"},
      {Dictionary("<f4", "(18446744073709551616, 3)"), "no length"},
      {Dictionary("<f4", "(1, 3)", "0"), "fortran_order"},
      {Dictionary("<f4", "[1, 3]"), "brackets"},
      {"{'descr': '<f4', 'shape': (1, 3), }", "lacks"},
      {"{}", "lacks"},
      {"", "no dictionary"},
      {"{'descr': '<f4', 'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), }", "too many"},
      {"{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), 'more': 1, }", "\"more\""},
      {Dictionary("<f4", "(1, 3)") + " x", "malformed"},
      {"{'descr': '<f4' 'fortran_order': False, 'shape': (1, 3), }", "malformed"},
      {"{'descr", "malformed"}};
  for (const auto& [dictionary, reason] : table) {
    SCOPED_TRACE(dictionary);
    const auto scan = Decode(NpyBytes(dictionary, Values<float>({1000, 2000, 300})));
    ASSERT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(scan.status().message()), HasSubstr(reason));
  }
}

TEST(Npy, RefusesWhatDoesNotBeginAsOne) {
  const std::string good = NaverBytes(SomePoints(3));
  std::string other_version = good;
  other_version[6] = 4;
  std::string long_header = good.substr(0, 6) + std::string("\x02\0\xff\xff\xff\xff", 6);
  for (const auto& [bytes, reason] : std::vector<std::pair<std::string, std::string>>{
           {"PK\x03\x04", "does not begin"},
           {other_version, "version is 4"},
           {long_header + good.substr(10), "4294967295 bytes"}}) {
    const auto scan = Decode(bytes);
    ASSERT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(scan.status().message()), HasSubstr(reason));
  }
}

TEST(Npy, RefusesEveryTruncation) {
  const std::string good = NaverBytes(SomePoints(4));
  ASSERT_TRUE(Decode(good).ok());
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_EQ(Decode(good.substr(0, size)).status().code(), absl::StatusCode::kInvalidArgument)
        << size;
  }
}

TEST(Npy, RefusesMetres) {
  std::vector<float> values;
  for (const Point& p : SomePoints(50)) values.insert(values.end(), {p.x, p.y, p.z});
  const auto scan = Decode(NpyBytes(Dictionary("<f4", "(50, 3)"), Values(values)));
  ASSERT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(scan.status().message()), HasSubstr("centimetres"));
}

TEST(Npy, IsReadByItsExtension) {
  const test::TempDir dir;
  const std::string path = dir.Write("00000.npy", NaverBytes(SomePoints(6)));
  EXPECT_TRUE(IsScanFile(path));
  const auto scan = ReadScan(path);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points, SomePoints(6));
  const auto bad = ReadScan(dir.Write("bad.npy", NpyBytes(Dictionary("<u2", "(1, 3)"), "")));
  EXPECT_THAT(std::string(bad.status().message()), HasSubstr("bad.npy"));
}

}  // namespace
}  // namespace scanloc::dataset
