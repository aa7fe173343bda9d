#include <lzf.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/strings/str_cat.h"
#include "pcd_header.hpp"
#include "scan_decoders.hpp"
#include "scanloc/core/byte_order.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

// Read here and not through PCL, whose PCDReader believes what a file says: it writes out of bounds
// on padded compressed fields, reads "abc" as 0, and unpacks fields that nobody asked for. The
// tests compare with it, file by file.

constexpr std::array<std::string_view, 3> kAxes = {"x", "y", "z"};
constexpr std::size_t kCompressedPrefixBytes = 8;  // compressed and uncompressed size
// LZF's longest back reference makes 264 bytes of 3.
constexpr std::uint64_t kMaxLzfRatio = 88;

const PcdField& FindField(const std::vector<PcdField>& fields, std::string_view name) {
  return *std::ranges::find(fields, name, &PcdField::name);
}

// The field of intensities, if it is asked for and can be read.
const PcdField* FindIntensity(const PcdHeader& header, bool with_intensities) {
  const auto found = std::ranges::find_if(header.fields, [](const PcdField& field) {
    return IsIntensity(field.name) && field.count == 1 &&
           (field.type == 'F' ? field.size >= 4 : field.size <= 4);
  });
  return with_intensities && found != header.fields.end() ? &*found : nullptr;
}

NumberType TypeOf(const PcdField& field) {
  return field.type == 'F' ? FloatOf(field.size) : *WholeOf(field.size, field.type == 'I');
}

absl::StatusOr<Scan> DecodeBinary(const PcdHeader& header, const PcdField* intensity,
                                  std::string_view body) {
  if (body.size() < header.num_points * header.record_bytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("truncated: ", header.num_points, " points of ", header.record_bytes,
                     " bytes need ", header.num_points * header.record_bytes, " bytes, but only ",
                     body.size(), " follow the header"));
  }
  BinaryLayout layout;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const PcdField& field = FindField(header.fields, kAxes[axis]);
    layout.xyz[axis] = {field.offset, header.record_bytes, FloatOf(field.size)};
  }
  if (intensity != nullptr) {
    layout.intensity = {intensity->offset, header.record_bytes, TypeOf(*intensity)};
  }
  return ReadBinary(layout, header.num_points, body);
}

// The bytes that follow the header of a binary_compressed file, decompressed to num_bytes.
absl::StatusOr<std::vector<char>> Decompress(std::string_view body, std::size_t num_bytes) {
  if (body.size() <= kCompressedPrefixBytes) {
    return absl::InvalidArgumentError(absl::StrCat(
        "truncated: only ", body.size(), " bytes follow the header of a binary_compressed file"));
  }
  const auto num_compressed = LoadNumber<std::uint32_t>(body.data());
  const auto num_announced = LoadNumber<std::uint32_t>(body.data() + sizeof(num_compressed));
  body.remove_prefix(kCompressedPrefixBytes);
  if (num_compressed == 0 || num_compressed > body.size()) {
    return absl::InvalidArgumentError(absl::StrCat("truncated: announces ", num_compressed,
                                                   " compressed bytes, but ", body.size(),
                                                   " follow"));
  }
  if (num_announced != num_bytes || num_bytes > kMaxLzfRatio * num_compressed) {
    return absl::InvalidArgumentError(
        absl::StrCat("announces ", num_announced, " bytes made of ", num_compressed,
                     " compressed ones, but its points need ", num_bytes));
  }
  std::vector<char> bytes(num_bytes);
  if (lzf_decompress(body.data(), num_compressed, bytes.data(), num_announced) != num_bytes) {
    return absl::InvalidArgumentError("its compressed points are damaged");
  }
  return bytes;
}

absl::StatusOr<Scan> DecodeCompressed(const PcdHeader& header, const PcdField* intensity,
                                      std::string_view body) {
  // All values of the first field, then all of the second, and so on; padding is not stored.
  BinaryLayout layout;
  std::size_t num_bytes = 0;
  for (const PcdField& field : header.fields) {
    if (field.name == "_") continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (field.name == kAxes[axis])
        layout.xyz[axis] = {num_bytes, field.size, FloatOf(field.size)};
    }
    if (&field == intensity) layout.intensity = {num_bytes, field.size, TypeOf(field)};
    num_bytes += header.num_points * field.size * field.count;
  }
  ASSIGN_OR_RETURN(const std::vector<char> bytes, Decompress(body, num_bytes));
  return ReadBinary(layout, header.num_points, {bytes.data(), bytes.size()});
}

absl::StatusOr<Scan> DecodeAscii(const PcdHeader& header, const PcdField* intensity,
                                 std::string_view body) {
  RowLayout layout{.num_columns = header.num_columns};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    layout.xyz[axis] = FindField(header.fields, kAxes[axis]).column;
  }
  if (intensity != nullptr) layout.intensity = intensity->column;
  LineReader lines(body, header.num_lines + 1);
  absl::StatusOr<Scan> scan = ReadTextRows(layout, header.num_points, lines);
  if (!scan.ok()) return scan;
  Tokens tokens;
  while (const std::optional<std::string_view> line = lines.Next()) {
    SplitAtBlanks(*line, tokens);
    if (!tokens.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("line ", lines.line_number(),
                                                     ": more rows than the ", header.num_points,
                                                     " points of the header"));
    }
  }
  return scan;
}

}  // namespace

absl::StatusOr<Scan> DecodePcd(std::string_view bytes, bool with_intensities) {
  ASSIGN_OR_RETURN(const PcdHeader header, ParsePcdHeader(bytes));
  if (header.num_points == 0) return Scan();
  const std::string_view body = bytes.substr(header.body_offset);
  const PcdField* const intensity = FindIntensity(header, with_intensities);
  switch (header.data) {
    case PcdHeader::Data::kAscii:
      return DecodeAscii(header, intensity, body);
    case PcdHeader::Data::kBinary:
      return DecodeBinary(header, intensity, body);
    case PcdHeader::Data::kBinaryCompressed:
      return DecodeCompressed(header, intensity, body);
  }
  return absl::InternalError("unknown kind of PCD data");
}

}  // namespace scanloc::dataset
