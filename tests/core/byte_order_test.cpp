#include "scanloc/core/byte_order.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

namespace scanloc {
namespace {

TEST(ByteOrder, LoadsNumbersInEitherOrderFromAnyAddress) {
  const std::string bytes("\xFF\x01\x02\x03\x84", 5);
  EXPECT_EQ(LoadNumber<std::uint32_t>(bytes.data() + 1), 0x84030201U);
  EXPECT_EQ(LoadNumber<std::uint32_t>(bytes.data() + 1, std::endian::big), 0x01020384U);
  EXPECT_EQ(LoadNumber<std::int16_t>(bytes.data() + 3), -31741);
  EXPECT_EQ(LoadNumber<std::uint8_t>(bytes.data()), 255);
}

TEST(ByteOrder, StoresTheLeastSignificantByteFirst) {
  std::string bytes(9, '\0');
  StoreLittleEndian(-2.0, bytes.data() + 1);
  EXPECT_EQ(bytes, std::string("\0\0\0\0\0\0\0\0\xC0", 9));
  StoreLittleEndian(std::uint16_t{0x1234}, bytes.data());
  EXPECT_EQ(bytes.substr(0, 2), "\x34\x12");
}

}  // namespace
}  // namespace scanloc
