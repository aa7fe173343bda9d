#include <lzf.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "scan_decoders.hpp"
#include "scanloc/core/byte_order.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

// Read here and not through PCL, whose PCDReader believes what a file says: it writes out of bounds
// on padded compressed fields, reads "abc" as 0, and unpacks fields that nobody asked for. The
// tests compare with it, file by file.

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
  std::vector<PcdField> fields;
  std::array<std::size_t, 3> xyz = {};                 ///< indices of fields
  std::optional<std::uint64_t> width, height, points;  ///< as written
  std::size_t num_points = 0;
  std::string_view data;        ///< ascii, binary or binary_compressed
  std::size_t num_columns = 0;  ///< of a row of text
  std::size_t record_bytes = 0;
  std::size_t body_offset = 0;  ///< first byte after the header
  std::size_t num_lines = 0;    ///< of the header
};

constexpr std::size_t kMaxHeaderLines = 1000;
constexpr std::size_t kMaxFields = 256;
constexpr std::uint32_t kMaxRecordBytes = 65536;

absl::Status BadPcd(std::string_view reason) {
  return absl::InvalidArgumentError(absl::StrCat("PCD header: ", ToAbsl(reason)));
}

template <typename Int>
bool ParseNumber(std::string_view token, Int& value) {
  return absl::SimpleAtoi(ToAbsl(token), &value);
}

absl::Status ParseFields(const Tokens& tokens, PcdHeader& header) {
  if (tokens.size() < 2) return BadPcd("FIELDS names no field");
  if (tokens.size() - 1 > kMaxFields) {
    return BadPcd(absl::StrCat("has ", tokens.size() - 1, " fields; at most ", kMaxFields));
  }
  if (!header.fields.empty()) return BadPcd("FIELDS is given twice");
  for (std::size_t i = 1; i < tokens.size(); ++i) {
    header.fields.push_back({.name = std::string(tokens[i])});
  }
  return absl::OkStatus();
}

// SIZE, TYPE and COUNT: one value a field.
absl::Status ParsePerField(const Tokens& tokens, PcdHeader& header) {
  const std::string_view key = tokens[0];
  if (tokens.size() - 1 != header.fields.size()) {
    return BadPcd(absl::StrCat(ToAbsl(key), " has ", tokens.size() - 1, " values for ",
                               header.fields.size(), " fields"));
  }
  for (std::size_t i = 0; i < header.fields.size(); ++i) {
    PcdField& field = header.fields[i];
    const std::string_view token = tokens[i + 1];
    bool ok = false;
    if (key == "TYPE") {
      field.type = token[0];
      ok = token == "I" || token == "U" || token == "F";
    } else if (key == "SIZE") {
      ok = ParseNumber(token, field.size) &&
           (field.size == 1 || field.size == 2 || field.size == 4 || field.size == 8);
    } else {
      ok = ParseNumber(token, field.count) && field.count <= kMaxRecordBytes;
    }
    if (!ok) {
      return BadPcd(absl::StrCat(ToAbsl(key), " ", Quote(token), " of field ", Quote(field.name),
                                 " is not known"));
    }
  }
  return absl::OkStatus();
}

absl::Status ParseCount(const Tokens& tokens, std::optional<std::uint64_t>& count) {
  std::uint64_t value = 0;
  if (tokens.size() != 2 || !ParseNumber(tokens[1], value)) {
    return BadPcd(absl::StrCat(ToAbsl(tokens[0]), " is not one whole number"));
  }
  count = value;
  return absl::OkStatus();
}

absl::Status ParseData(const Tokens& tokens, PcdHeader& header) {
  header.data = tokens.size() == 2 ? tokens[1] : "";
  for (const std::string_view kind : {"ascii", "binary", "binary_compressed"}) {
    if (header.data == kind) return absl::OkStatus();
  }
  return BadPcd(absl::StrCat("DATA ", tokens.size() > 1 ? Quote(tokens[1]) : "",
                             " is not ascii, binary or binary_compressed"));
}

absl::Status ParseLine(const Tokens& tokens, PcdHeader& header) {
  const std::string_view key = tokens[0];
  if (key == "FIELDS" || key == "COLUMNS") return ParseFields(tokens, header);
  if (key == "SIZE" || key == "TYPE" || key == "COUNT") return ParsePerField(tokens, header);
  if (key == "WIDTH") return ParseCount(tokens, header.width);
  if (key == "HEIGHT") return ParseCount(tokens, header.height);
  if (key == "POINTS") return ParseCount(tokens, header.points);
  if (key == "VERSION" || key == "VIEWPOINT") return absl::OkStatus();
  if (key == "DATA") return ParseData(tokens, header);
  return BadPcd(absl::StrCat("line begins with ", Quote(key), ", which no PCD file knows"));
}

// POINTS rules where WIDTH or HEIGHT is 0 or absent: files of some tools have points nevertheless.
absl::Status SetNumPoints(PcdHeader& header) {
  const std::uint64_t width = header.width.value_or(0);
  const std::uint64_t height = header.height.value_or(0);
  if (!header.points && (!header.width || !header.height)) {
    return BadPcd("has neither POINTS nor WIDTH and HEIGHT");
  }
  // Checked before they are multiplied.
  for (const std::uint64_t count : {width, height, header.points.value_or(0)}) {
    if (count > limits::kMaxPointsPerScan) {
      return BadPcd(absl::StrCat("announces ", count, " points; a scan has at most ",
                                 limits::kMaxPointsPerScan));
    }
  }
  const std::uint64_t num_points = header.points.value_or(width * height);
  if (width != 0 && height != 0 && width * height != num_points) {
    return BadPcd(
        absl::StrCat("WIDTH ", width, " x HEIGHT ", height, " differs from POINTS ", num_points));
  }
  if (num_points > limits::kMaxPointsPerScan) {
    return BadPcd(absl::StrCat("announces ", num_points, " points; a scan has at most ",
                               limits::kMaxPointsPerScan));
  }
  header.num_points = num_points;
  return absl::OkStatus();
}

absl::Status LayOutFields(PcdHeader& header) {
  for (PcdField& field : header.fields) {
    field.offset = header.record_bytes;
    field.column = header.num_columns;
    header.record_bytes += static_cast<std::size_t>(field.size) * field.count;
    header.num_columns += field.count;
    if (header.record_bytes > kMaxRecordBytes) {
      return BadPcd(absl::StrCat("a point has more than ", kMaxRecordBytes, " bytes"));
    }
  }
  if (header.num_points * header.record_bytes >
      static_cast<std::uint64_t>(limits::kMaxScanFileBytes)) {
    return BadPcd(absl::StrCat(header.num_points, " points of ", header.record_bytes,
                               " bytes are more than ", limits::kMaxScanFileBytes, " bytes"));
  }
  return absl::OkStatus();
}

absl::Status FindCoordinates(PcdHeader& header) {
  constexpr std::array<std::string_view, 3> kAxes = {"x", "y", "z"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string_view name = kAxes[axis];
    const auto is_it = [name](const PcdField& field) { return field.name == name; };
    const auto num = std::ranges::count_if(header.fields, is_it);
    if (num != 1) {
      return BadPcd(absl::StrCat("has ", num, " fields named ", ToAbsl(name), "; one is needed"));
    }
    const auto field = std::ranges::find_if(header.fields, is_it);
    if (field->type != 'F' || field->count != 1 || (field->size != 4 && field->size != 8)) {
      return BadPcd(absl::StrCat("field ", ToAbsl(name), " has TYPE ", std::string(1, field->type),
                                 " SIZE ", field->size, " COUNT ", field->count,
                                 "; TYPE F, SIZE 4 or 8 and COUNT 1 are read"));
    }
    header.xyz[axis] = static_cast<std::size_t>(field - header.fields.begin());
  }
  return absl::OkStatus();
}

/// Parses the header and checks that the body can be there as far as the header alone tells.
absl::StatusOr<PcdHeader> ParsePcdHeader(std::string_view bytes) {
  PcdHeader header;
  LineReader lines(bytes);
  Tokens tokens;
  while (header.data.empty()) {
    const std::optional<std::string_view> line = lines.Next();
    if (!line || lines.line_number() > kMaxHeaderLines) {
      return BadPcd("has no DATA line: truncated or not a PCD file");
    }
    SplitAtBlanks(*line, tokens);
    if (tokens.empty() || tokens[0][0] == '#') continue;
    RETURN_IF_ERROR(ParseLine(tokens, header));
  }
  header.body_offset = bytes.size() - lines.rest().size();
  header.num_lines = lines.line_number();
  for (const absl::Status& status :
       {SetNumPoints(header), LayOutFields(header), FindCoordinates(header)}) {
    if (!status.ok()) return status;
  }
  return header;
}

constexpr std::size_t kCompressedPrefixBytes = 8;  // compressed and uncompressed size
// LZF's longest back reference makes 264 bytes of 3.
constexpr std::uint64_t kMaxLzfRatio = 88;

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
    const PcdField& field = header.fields[header.xyz[axis]];
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
      if (&field != &header.fields[header.xyz[axis]]) continue;
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
    layout.xyz[axis] = header.fields[header.xyz[axis]].column;
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
  if (header.data == "ascii") return DecodeAscii(header, intensity, body);
  return header.data == "binary" ? DecodeBinary(header, intensity, body)
                                 : DecodeCompressed(header, intensity, body);
}

}  // namespace scanloc::dataset
