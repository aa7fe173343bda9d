// NumPy arrays of descriptors.
#include "scanloc/dataset/matrix_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::dataset {
namespace {

using test::AppendBytes;
using test::NpyBytes;
using ::testing::HasSubstr;

template <typename Number>
std::string Array(const std::string& descr, const std::string& shape,
                  const std::vector<Number>& values, const std::string& order = "False") {
  std::string bytes;
  for (const Number value : values) AppendBytes(bytes, value);
  return NpyBytes(absl::StrCat("{'descr': '", descr, "', 'fortran_order': ", order,
                               ", 'shape': ", shape, ", }"),
                  bytes);
}

template <typename Number>
void ExpectBothOrders(const std::string& descr) {
  SCOPED_TRACE(descr);
  RowMatrix expected(2, 3);
  expected << 1, 2, 3, -4, 5, 6;
  const auto rows = DecodeNpyMatrix(Array<Number>(descr, "(2, 3)", {1, 2, 3, -4, 5, 6}));
  const auto columns = DecodeNpyMatrix(Array<Number>(descr, "(2, 3)", {1, -4, 2, 5, 3, 6}, "True"));
  ASSERT_TRUE(rows.ok()) << rows.status();
  ASSERT_TRUE(columns.ok()) << columns.status();
  EXPECT_EQ(*rows, expected);
  EXPECT_EQ(*columns, expected);
}

TEST(MatrixFile, ReadsTheFourTypesInBothOrders) {
  ExpectBothOrders<std::int16_t>("<i2");
  ExpectBothOrders<std::int32_t>("<i4");
  ExpectBothOrders<float>("<f4");
  ExpectBothOrders<double>("<f8");
}

TEST(MatrixFile, RefusesShapesTypesAndValuesThatAreNoDescriptors) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const struct {
    std::string bytes, reason;
  } cases[] = {
      {Array<float>("<f4", "(2,)", {1, 2}), "1 dimensions; two are needed"},
      {Array<float>("<f4", "(1, 1, 2)", {1, 2}), "3 dimensions"},
      {Array<float>("<f4", "(0, 2)", {}), "0 rows"},
      {Array<float>("<f4", "(2, 0)", {}), "0 columns"},
      {Array<float>("<f4", "(1, 65537)", {}), "65537 columns"},
      {Array<float>("<f4", "(10000001, 1)", {}), "10000001 rows"},
      {Array<float>("<f4", "(18446744073709551615, 65536)", {}), "rows"},
      {Array<float>("<f4", "(10000000, 65536)", {1}), "truncated: its shape needs 2621440000000"},
      {Array<float>("<f4", "(1, 2)", {1, 2, 3}), "4 bytes follow the values"},
      {Array<float>("<f2", "(1, 2)", {1}), "type \"<f2\""},
      {Array<float>(">f4", "(1, 2)", {1, 2}), "type \">f4\""},
      {Array<float>("|O", "(1, 2)", {1, 2}), "type \"|O\""},
      {Array<float>("<f4", "(2, 2)", {1, 2, 3, kNan}), "row 1, column 1 is nan"},
      {Array<double>("<f8", "(1, 2)", {1e300, 2}), "row 0, column 0 is 1e+300"},
      {std::string("PK\3\4 an .npz"), "does not begin as a NumPy array"},
      {std::string(), "does not begin"},
  };
  for (const auto& [bytes, reason] : cases) {
    const auto matrix = DecodeNpyMatrix(bytes);
    EXPECT_EQ(matrix.status().code(), absl::StatusCode::kInvalidArgument) << reason;
    EXPECT_THAT(std::string(matrix.status().message()), HasSubstr(reason));
  }
}

TEST(MatrixFile, NamesTheFile) {
  const test::TempDir dir;
  dir.Write("d.npy", Array<float>("<f4", "(1, 2)", {1, 2, 3}));
  EXPECT_THAT(std::string(ReadMatrix(dir.File("d.npy")).status().message()), HasSubstr("d.npy"));
  EXPECT_EQ(ReadMatrix(dir.File("none.npy")).status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace scanloc::dataset
