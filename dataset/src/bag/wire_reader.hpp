#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/byte_order.hpp"
#include "scanloc/dataset/bag.hpp"

namespace scanloc::dataset {

/// Reads the values of a message one after the other. After the first value that is not there, all
/// are zero and ok() is false; nothing is read beyond the message.
class WireReader {
 public:
  /// InvalidArgument if the message is too short for its own head or of an unknown encapsulation.
  [[nodiscard]] static absl::StatusOr<WireReader> Create(WireFormat format, std::string_view bytes);

  [[nodiscard]] bool ok() const { return is_ok_; }
  [[nodiscard]] bool is_ros1() const { return format_ == WireFormat::kRos1; }

  template <typename Number>
  Number Read() {
    const std::string_view bytes = Take(sizeof(Number), sizeof(Number));
    if (bytes.empty()) return Number{};
    return LoadNumber<Number>(bytes.data(),
                              is_big_endian_ ? std::endian::big : std::endian::little);
  }

  /// A string, or the bytes of an array of bytes, within the message.
  std::string_view ReadString() {
    std::string_view text = Take(Read<std::uint32_t>(), 1);
    // CDR counts the zero at the end.
    if (!is_ros1() && !text.empty() && text.back() == '\0') text.remove_suffix(1);
    return text;
  }
  std::string_view ReadBytes() { return Take(Read<std::uint32_t>(), 1); }

  [[nodiscard]] std::size_t num_left() const { return bytes_.size() - at_; }

 private:
  WireReader(WireFormat format, std::string_view bytes, bool is_big_endian, std::size_t max_align)
      : format_(format), bytes_(bytes), is_big_endian_(is_big_endian), max_align_(max_align) {}

  std::string_view Take(std::size_t num_bytes, std::size_t align) {
    align = std::min(align, max_align_);
    const std::size_t begin = (at_ + align - 1) / align * align;
    if (!is_ok_ || begin > bytes_.size() || num_bytes > bytes_.size() - begin) {
      is_ok_ = false;
      return {};
    }
    at_ = begin + num_bytes;
    return bytes_.substr(begin, num_bytes);
  }

  WireFormat format_;
  std::string_view bytes_;  // after the encapsulation
  bool is_big_endian_;
  std::size_t max_align_;
  std::size_t at_ = 0;
  bool is_ok_ = true;
};

inline absl::StatusOr<WireReader> WireReader::Create(WireFormat format, std::string_view bytes) {
  if (format == WireFormat::kRos1) return WireReader(format, bytes, false, 1);
  constexpr std::size_t kHeadBytes = 4;
  if (format != WireFormat::kCdr || bytes.size() < kHeadBytes || bytes[0] != '\0') {
    return absl::InvalidArgumentError("is not in CDR");
  }
  const auto kind = static_cast<unsigned char>(bytes[1]);
  bytes.remove_prefix(kHeadBytes);
  // 0 and 1 are CDR, 6 and 7 are CDR of version 2 without parameters; odd is little endian.
  if (kind <= 1) return WireReader(format, bytes, kind == 0, 8);
  if (kind == 6 || kind == 7) return WireReader(format, bytes, kind == 6, 4);
  return absl::InvalidArgumentError("is in a form of CDR that is not read");
}

}  // namespace scanloc::dataset
