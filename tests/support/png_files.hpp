#pragma once

#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>

namespace scanloc::test {

/// A PNG of that shape, written without libpng. `pixels` row by row; colour type 0: greys, 2: RGB.
inline std::string PngBytes(std::uint32_t width, std::uint32_t height, const std::string& pixels,
                            char bit_depth = 8, char colour_type = 0) {
  const auto number = [](std::uint32_t value) {
    std::string bytes;
    for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>(value >> shift);
    return bytes;
  };
  const auto chunk = [&](const std::string& type, const std::string& data) {
    const std::string body = type + data;
    const auto sum =
        crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
    return number(static_cast<std::uint32_t>(data.size())) + body +
           number(static_cast<std::uint32_t>(sum));
  };
  std::string rows;
  const std::size_t row_bytes = height == 0 ? 0 : pixels.size() / height;
  for (std::size_t row = 0; row < height; ++row) {
    rows += '\0';  // no filter
    rows += pixels.substr(row * row_bytes, row_bytes);
  }
  uLongf num_packed = compressBound(rows.size());
  std::string packed(num_packed, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &num_packed,
           reinterpret_cast<const Bytef*>(rows.data()), rows.size());
  packed.resize(num_packed);
  return "\x89PNG\r\n\x1a\n" +
         chunk("IHDR",
               number(width) + number(height) + bit_depth + colour_type + std::string(3, '\0')) +
         chunk("IDAT", packed) + chunk("IEND", "");
}

/// The head of a row of Oxford's: time, step of the encoder, whether it was measured.
inline std::string OxfordHead(unsigned step, char is_measured = '\xff') {
  return std::string(8, '\1') + static_cast<char>(step & 0xffU) + static_cast<char>(step >> 8U) +
         is_measured;
}

}  // namespace scanloc::test
