#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace scanloc::dataset {

/// One field of a PCD file: `count` elements of `size` bytes.
struct PcdField {
  std::string name;  ///< "_" is padding
  std::uint32_t size = 4;
  char type = 'F';          ///< I, U or F
  std::uint32_t count = 1;  ///< 0: takes no room, as padding of some drivers
  std::size_t offset = 0;   ///< of its first byte in a record
  std::size_t column = 0;   ///< of its first element in a row of text
};

/// The header of a PCD file, checked: fields of known types, x y z present as F 4 or F 8, a record
/// and a number of points within the limits.
struct PcdHeader {
  enum class Data { kAscii, kBinary, kBinaryCompressed };

  std::vector<PcdField> fields;
  std::size_t num_points = 0;
  Data data = Data::kAscii;
  std::size_t num_columns = 0;  ///< of a row of text
  std::size_t record_bytes = 0;
  std::size_t body_offset = 0;  ///< first byte after the header
  std::size_t num_lines = 0;    ///< of the header
};

/// Parses the header and checks that the body can be there as far as the header alone tells.
[[nodiscard]] absl::StatusOr<PcdHeader> ParsePcdHeader(std::string_view bytes);

}  // namespace scanloc::dataset
