#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "scan_decoders.hpp"
#include "scanloc/core/limits.hpp"

namespace scanloc::dataset {
namespace {

// Read here and not through PCL, whose reader takes a path only, refuses NaN in text, and writes
// and reads out of bounds on headers with unusual colours or range grids.

using Tokens = std::vector<std::string_view>;

constexpr std::size_t kMaxPlyHeaderLines = 1000;
constexpr std::size_t kMaxProperties = 256;

struct Property {
  std::string_view name;
  std::size_t size_bytes = 0;
  bool is_float = false;
};

struct PlyHeader {
  enum class Format { kNone, kAscii, kLittleEndian, kBigEndian };

  Format format = Format::kNone;
  std::size_t num_elements = 0;
  std::uint64_t num_vertices = 0;
  std::vector<Property> properties;  ///< of a vertex
};

absl::Status BadPly(std::string_view reason) {
  return absl::InvalidArgumentError(absl::StrCat("PLY header: ", ToAbsl(reason)));
}

absl::Status ParseFormat(const Tokens& tokens, PlyHeader& header) {
  using Format = PlyHeader::Format;
  if (header.format != Format::kNone) return BadPly("format is given twice");
  const std::string_view name = tokens.size() == 3 ? tokens[1] : std::string_view();
  if (name == "ascii") header.format = Format::kAscii;
  if (name == "binary_little_endian") header.format = Format::kLittleEndian;
  if (name == "binary_big_endian") header.format = Format::kBigEndian;
  if (header.format == Format::kNone || tokens[2] != "1.0") {
    return BadPly("format is not ascii, binary_little_endian or binary_big_endian 1.0");
  }
  return absl::OkStatus();
}

absl::Status ParseElement(const Tokens& tokens, PlyHeader& header) {
  std::uint64_t count = 0;
  if (tokens.size() != 3 || !absl::SimpleAtoi(ToAbsl(tokens[2]), &count)) {
    return BadPly("element line is not \"element NAME COUNT\"");
  }
  if (header.num_elements++ > 0) {
    return tokens[1] == "vertex"
               ? BadPly("vertex must be the first element, and the only one so named")
               : absl::OkStatus();
  }
  if (tokens[1] != "vertex") {
    return BadPly(absl::StrCat("the first element is ", Quote(tokens[1]), "; it must be vertex"));
  }
  if (count > limits::kMaxPointsPerScan) {
    return BadPly(absl::StrCat("announces ", count, " points; a scan has at most ",
                               limits::kMaxPointsPerScan));
  }
  header.num_vertices = count;
  return absl::OkStatus();
}

absl::Status ParseProperty(const Tokens& tokens, PlyHeader& header) {
  struct NamedType {
    std::string_view name, alias;
    std::size_t size_bytes;
    bool is_float;
  };
  constexpr std::array<NamedType, 8> kNamedTypes = {{{"char", "int8", 1, false},
                                                     {"uchar", "uint8", 1, false},
                                                     {"short", "int16", 2, false},
                                                     {"ushort", "uint16", 2, false},
                                                     {"int", "int32", 4, false},
                                                     {"uint", "uint32", 4, false},
                                                     {"float", "float32", 4, true},
                                                     {"double", "float64", 8, true}}};
  if (header.num_elements == 0) return BadPly("property before any element");
  if (header.num_elements > 1) return absl::OkStatus();
  if (tokens.size() != 3) {
    return BadPly("a vertex property is not \"property TYPE NAME\"; lists are not read");
  }
  if (header.properties.size() == kMaxProperties) {
    return BadPly(absl::StrCat("a vertex has more than ", kMaxProperties, " properties"));
  }
  const auto* const type =
      std::find_if(kNamedTypes.begin(), kNamedTypes.end(), [&](const NamedType& candidate) {
        return tokens[1] == candidate.name || tokens[1] == candidate.alias;
      });
  if (type == kNamedTypes.end())
    return BadPly(absl::StrCat("type ", Quote(tokens[1]), " is not known"));
  header.properties.push_back(
      {.name = tokens[2], .size_bytes = type->size_bytes, .is_float = type->is_float});
  return absl::OkStatus();
}

absl::StatusOr<PlyHeader> ParseHeader(LineReader& lines) {
  PlyHeader header;
  Tokens tokens;
  SplitAtBlanks(lines.Next().value_or(""), tokens);
  if (tokens != Tokens{"ply"}) return BadPly("does not begin with a line \"ply\": not a PLY file");
  while (const std::optional<std::string_view> line = lines.Next()) {
    SplitAtBlanks(*line, tokens);
    const std::string_view key = tokens.empty() ? std::string_view("comment") : tokens[0];
    absl::Status status;
    if (key == "end_header") return header;
    if (key == "format") {
      status = ParseFormat(tokens, header);
    } else if (key == "element") {
      status = ParseElement(tokens, header);
    } else if (key == "property") {
      status = ParseProperty(tokens, header);
    } else if (key != "comment" && key != "obj_info") {
      status = BadPly(absl::StrCat("line begins with ", Quote(key), ", which no PLY file knows"));
    }
    if (!status.ok()) return status;
    if (lines.line_number() > kMaxPlyHeaderLines) break;
  }
  return BadPly("has no end_header line: truncated or not a PLY file");
}

// The index of each coordinate among the properties of a vertex.
absl::StatusOr<std::array<std::size_t, 3>> FindCoordinates(const PlyHeader& header) {
  if (header.format == PlyHeader::Format::kNone) return BadPly("has no format line");
  if (header.num_elements == 0) return BadPly("has no vertex element");
  constexpr std::array<std::string_view, 3> kNames = {"x", "y", "z"};
  std::array<std::size_t, 3> xyz{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto is_it = [&](const Property& property) { return property.name == kNames[i]; };
    const auto& all = header.properties;
    const auto property = std::find_if(all.begin(), all.end(), is_it);
    if (std::count_if(all.begin(), all.end(), is_it) != 1 || !property->is_float) {
      return BadPly(absl::StrCat("a vertex needs one property ", ToAbsl(kNames[i]),
                                 " of type float or double"));
    }
    xyz[i] = static_cast<std::size_t>(property - all.begin());
  }
  return xyz;
}

absl::StatusOr<Scan> DecodeBinary(const PlyHeader& header, const std::array<std::size_t, 3>& xyz,
                                  std::string_view body) {
  BinaryLayout layout{.big_endian = header.format == PlyHeader::Format::kBigEndian};
  std::size_t vertex_bytes = 0;
  for (std::size_t i = 0; i < header.properties.size(); ++i) {
    const Property& property = header.properties[i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (xyz[axis] != i) continue;
      layout.xyz[axis].offset_bytes = vertex_bytes;
      layout.xyz[axis].type = FloatOf(property.size_bytes);
    }
    vertex_bytes += property.size_bytes;
  }
  for (Coordinate& coordinate : layout.xyz) coordinate.stride_bytes = vertex_bytes;
  if (body.size() / vertex_bytes < header.num_vertices) {
    return absl::InvalidArgumentError(
        absl::StrCat("truncated: ", header.num_vertices, " points of ", vertex_bytes,
                     " bytes need ", header.num_vertices * vertex_bytes, " bytes, but only ",
                     body.size(), " follow the header"));
  }
  return ReadBinary(layout, header.num_vertices, body);
}

absl::StatusOr<Scan> DecodeAscii(const PlyHeader& header, const std::array<std::size_t, 3>& xyz,
                                 LineReader& lines) {
  const RowLayout layout{.num_columns = header.properties.size(), .xyz = xyz};
  return ReadTextRows(layout, header.num_vertices, lines);
}

}  // namespace

absl::StatusOr<Scan> DecodePly(std::string_view bytes) {
  LineReader lines(bytes);
  const absl::StatusOr<PlyHeader> header = ParseHeader(lines);
  if (!header.ok()) return header.status();
  const absl::StatusOr<std::array<std::size_t, 3>> xyz = FindCoordinates(*header);
  if (!xyz.ok()) return xyz.status();
  if (header->format == PlyHeader::Format::kAscii) return DecodeAscii(*header, *xyz, lines);
  return DecodeBinary(*header, *xyz, lines.rest());
}

}  // namespace scanloc::dataset
