#include "pcd_header.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::size_t kMaxHeaderLines = 1000;
constexpr std::size_t kMaxFields = 256;
constexpr std::uint32_t kMaxRecordBytes = 65536;

// The lines of a header, as written.
struct RawHeader {
  std::optional<std::uint64_t> width, height, points;
  bool has_data = false;
};

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
  using Data = PcdHeader::Data;
  constexpr std::array<std::pair<std::string_view, Data>, 3> kDataKinds = {
      {{"ascii", Data::kAscii},
       {"binary", Data::kBinary},
       {"binary_compressed", Data::kBinaryCompressed}}};
  for (const auto& [name, data] : kDataKinds) {
    if (tokens.size() == 2 && tokens[1] == name) {
      header.data = data;
      return absl::OkStatus();
    }
  }
  return BadPcd(absl::StrCat("DATA ", tokens.size() > 1 ? Quote(tokens[1]) : "",
                             " is not ascii, binary or binary_compressed"));
}

absl::Status ParseLine(const Tokens& tokens, PcdHeader& header, RawHeader& raw) {
  const std::string_view key = tokens[0];
  if (key == "FIELDS" || key == "COLUMNS") return ParseFields(tokens, header);
  if (key == "SIZE" || key == "TYPE" || key == "COUNT") return ParsePerField(tokens, header);
  if (key == "WIDTH") return ParseCount(tokens, raw.width);
  if (key == "HEIGHT") return ParseCount(tokens, raw.height);
  if (key == "POINTS") return ParseCount(tokens, raw.points);
  if (key == "VERSION" || key == "VIEWPOINT") return absl::OkStatus();
  if (key == "DATA") {
    raw.has_data = true;
    return ParseData(tokens, header);
  }
  return BadPcd(absl::StrCat("line begins with ", Quote(key), ", which no PCD file knows"));
}

// POINTS rules where WIDTH or HEIGHT is 0 or absent: files of some tools have points nevertheless.
absl::Status SetNumPoints(const RawHeader& raw, PcdHeader& header) {
  const std::uint64_t width = raw.width.value_or(0);
  const std::uint64_t height = raw.height.value_or(0);
  if (!raw.points && (!raw.width || !raw.height)) {
    return BadPcd("has neither POINTS nor WIDTH and HEIGHT");
  }
  // Checked before they are multiplied.
  for (const std::uint64_t count : {width, height, raw.points.value_or(0)}) {
    if (count > limits::kMaxPointsPerScan) {
      return BadPcd(absl::StrCat("announces ", count, " points; a scan has at most ",
                                 limits::kMaxPointsPerScan));
    }
  }
  const std::uint64_t num_points = raw.points.value_or(width * height);
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

absl::Status CheckCoordinates(const PcdHeader& header) {
  for (const std::string_view name : {"x", "y", "z"}) {
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
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PcdHeader> ParsePcdHeader(std::string_view bytes) {
  PcdHeader header;
  RawHeader raw;
  LineReader lines(bytes);
  Tokens tokens;
  while (!raw.has_data) {
    const std::optional<std::string_view> line = lines.Next();
    if (!line || lines.line_number() > kMaxHeaderLines) {
      return BadPcd("has no DATA line: truncated or not a PCD file");
    }
    SplitAtBlanks(*line, tokens);
    if (tokens.empty() || tokens[0][0] == '#') continue;
    RETURN_IF_ERROR(ParseLine(tokens, header, raw));
  }
  header.body_offset = bytes.size() - lines.rest().size();
  header.num_lines = lines.line_number();
  for (const absl::Status& status :
       {SetNumPoints(raw, header), LayOutFields(header), CheckCoordinates(header)}) {
    if (!status.ok()) return status;
  }
  return header;
}

}  // namespace scanloc::dataset
