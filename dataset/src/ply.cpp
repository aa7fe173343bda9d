#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "scan_decoders.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

// Read here and not through PCL, whose reader takes a path only, refuses NaN in text, and writes
// and reads out of bounds on headers with unusual colours or range grids.

constexpr std::size_t kMaxPlyHeaderLines = 1000;
constexpr std::size_t kMaxProperties = 256;

struct Property {
  std::string_view name;
  NumberType type = NumberType::kFloat32;
  std::size_t size_bytes = 0;

  [[nodiscard]] bool is_float() const {
    return type == NumberType::kFloat32 || type == NumberType::kFloat64;
  }
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
    NumberType type;
    std::size_t size_bytes;
  };
  using enum NumberType;
  constexpr std::array<NamedType, 8> kNamedTypes = {{{"char", "int8", kInt8, 1},
                                                     {"uchar", "uint8", kUint8, 1},
                                                     {"short", "int16", kInt16, 2},
                                                     {"ushort", "uint16", kUint16, 2},
                                                     {"int", "int32", kInt32, 4},
                                                     {"uint", "uint32", kUint32, 4},
                                                     {"float", "float32", kFloat32, 4},
                                                     {"double", "float64", kFloat64, 8}}};
  if (header.num_elements == 0) return BadPly("property before any element");
  if (header.num_elements > 1) return absl::OkStatus();
  if (tokens.size() != 3) {
    return BadPly("a vertex property is not \"property TYPE NAME\"; lists are not read");
  }
  if (header.properties.size() == kMaxProperties) {
    return BadPly(absl::StrCat("a vertex has more than ", kMaxProperties, " properties"));
  }
  const auto* const type = std::ranges::find_if(kNamedTypes, [&](const NamedType& candidate) {
    return tokens[1] == candidate.name || tokens[1] == candidate.alias;
  });
  if (type == kNamedTypes.end())
    return BadPly(absl::StrCat("type ", Quote(tokens[1]), " is not known"));
  header.properties.push_back(
      {.name = tokens[2], .type = type->type, .size_bytes = type->size_bytes});
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
    const auto property = std::ranges::find_if(all, is_it);
    if (std::ranges::count_if(all, is_it) != 1 || !property->is_float()) {
      return BadPly(absl::StrCat("a vertex needs one property ", ToAbsl(kNames[i]),
                                 " of type float or double"));
    }
    xyz[i] = static_cast<std::size_t>(property - all.begin());
  }
  return xyz;
}

// The index of the intensity, if it is asked for and there.
std::optional<std::size_t> FindIntensity(const PlyHeader& header, bool with_intensities) {
  const auto found = std::ranges::find_if(
      header.properties, [](const Property& property) { return IsIntensity(property.name); });
  if (!with_intensities || found == header.properties.end()) return std::nullopt;
  return static_cast<std::size_t>(found - header.properties.begin());
}

absl::StatusOr<Scan> DecodeBinary(const PlyHeader& header, const RowLayout& columns,
                                  std::string_view body) {
  BinaryLayout layout{.big_endian = header.format == PlyHeader::Format::kBigEndian};
  std::size_t vertex_bytes = 0;
  for (std::size_t i = 0; i < header.properties.size(); ++i) {
    const Property& property = header.properties[i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (columns.xyz[axis] != i) continue;
      layout.xyz[axis].offset_bytes = vertex_bytes;
      layout.xyz[axis].type = property.type;
    }
    if (columns.intensity == i) layout.intensity = {vertex_bytes, 0, property.type};
    vertex_bytes += property.size_bytes;
  }
  for (Coordinate& coordinate : layout.xyz) coordinate.stride_bytes = vertex_bytes;
  if (layout.intensity) layout.intensity->stride_bytes = vertex_bytes;
  if (body.size() / vertex_bytes < header.num_vertices) {
    return absl::InvalidArgumentError(
        absl::StrCat("truncated: ", header.num_vertices, " points of ", vertex_bytes,
                     " bytes need ", header.num_vertices * vertex_bytes, " bytes, but only ",
                     body.size(), " follow the header"));
  }
  return ReadBinary(layout, header.num_vertices, body);
}

}  // namespace

absl::StatusOr<Scan> DecodePly(std::string_view bytes, bool with_intensities) {
  LineReader lines(bytes);
  ASSIGN_OR_RETURN(const PlyHeader header, ParseHeader(lines));
  ASSIGN_OR_RETURN(const auto xyz, FindCoordinates(header));
  const RowLayout columns{.num_columns = header.properties.size(),
                          .xyz = xyz,
                          .intensity = FindIntensity(header, with_intensities)};
  if (header.format == PlyHeader::Format::kAscii) {
    return ReadTextRows(columns, header.num_vertices, lines);
  }
  return DecodeBinary(header, columns, lines.rest());
}

}  // namespace scanloc::dataset
