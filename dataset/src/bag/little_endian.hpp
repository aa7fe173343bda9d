#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "scanloc/core/byte_order.hpp"

namespace scanloc::dataset {

/// Reads little-endian values one after the other. After the first that is not there, all are zero
/// or empty and ok() is false.
class LittleEndian {
 public:
  explicit LittleEndian(std::string_view bytes) : bytes_(bytes) {}

  [[nodiscard]] bool ok() const { return is_ok_; }
  [[nodiscard]] std::size_t num_left() const { return bytes_.size(); }

  template <typename Number>
  Number Read() {
    const std::string_view bytes = Take(sizeof(Number));
    return bytes.empty() ? Number{} : LoadNumber<Number>(bytes.data());
  }

  /// As many bytes as the 32-bit number before them says.
  std::string_view ReadString() { return Take(Read<std::uint32_t>()); }
  void Skip(std::size_t num_bytes) { Take(num_bytes); }

 private:
  std::string_view Take(std::size_t num_bytes) {
    if (!is_ok_ || num_bytes > bytes_.size()) {
      is_ok_ = false;
      bytes_ = {};
      return {};
    }
    const std::string_view taken = bytes_.substr(0, num_bytes);
    bytes_.remove_prefix(num_bytes);
    return taken;
  }

  std::string_view bytes_;
  bool is_ok_ = true;
};

}  // namespace scanloc::dataset
