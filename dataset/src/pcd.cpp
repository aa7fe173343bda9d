#include <pcl/PCLPointCloud2.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <exception>
#include <new>

#include "absl/strings/str_cat.h"
#include "pcd_header.hpp"
#include "scan_decoders.hpp"

namespace scanloc::dataset {
namespace {

// PCL believes what a file says, so it sees a body only after the header and all sizes were
// checked here, and never the header itself.

constexpr std::size_t kCompressedPrefixBytes = 8;  // compressed and uncompressed size
// LZF's longest back reference makes 264 bytes of 3.
constexpr std::uint64_t kMaxLzfRatio = 88;

std::uint8_t PclDatatype(const PcdField& field) {
  using Types = pcl::PCLPointField;
  switch (field.type) {
    case 'I':
      return field.size == 1   ? Types::INT8
             : field.size == 2 ? Types::INT16
             : field.size == 4 ? Types::INT32
                               : Types::INT64;
    case 'U':
      return field.size == 1   ? Types::UINT8
             : field.size == 2 ? Types::UINT16
             : field.size == 4 ? Types::UINT32
                               : Types::UINT64;
    default:
      return field.size == 4 ? Types::FLOAT32 : Types::FLOAT64;
  }
}

// An empty cloud that PCL fills, of the given fields of the file.
pcl::PCLPointCloud2 MakeCloud(const std::vector<PcdField>& fields, std::size_t record_bytes,
                              std::size_t num_points) {
  pcl::PCLPointCloud2 cloud;
  for (const PcdField& field : fields) {
    pcl::PCLPointField pcl_field;
    pcl_field.name = field.name;
    pcl_field.offset = static_cast<pcl::uindex_t>(field.offset);
    pcl_field.datatype = PclDatatype(field);
    pcl_field.count = field.count;
    cloud.fields.push_back(pcl_field);
  }
  cloud.width = static_cast<pcl::uindex_t>(num_points);
  cloud.height = 1;
  cloud.point_step = static_cast<pcl::uindex_t>(record_bytes);
  cloud.row_step = static_cast<pcl::uindex_t>(record_bytes * num_points);
  cloud.data.resize(record_bytes * num_points);
  return cloud;
}

const PcdField& FindField(const std::vector<PcdField>& fields, std::string_view name) {
  return *std::find_if(fields.begin(), fields.end(),
                       [name](const PcdField& field) { return field.name == name; });
}

RecordLayout MakeRecordLayout(const std::vector<PcdField>& fields, std::size_t record_bytes) {
  RecordLayout layout{.record_bytes = record_bytes};
  constexpr std::array<std::string_view, 3> kNames = {"x", "y", "z"};
  for (std::size_t i = 0; i < 3; ++i) {
    const PcdField& field = FindField(fields, kNames[i]);
    layout.xyz[i] = {.offset_bytes = field.offset, .is_double = field.size == 8};
  }
  return layout;
}

absl::StatusOr<Scan> ReadWithPcl(std::string_view body, bool compressed,
                                 const std::vector<PcdField>& fields, std::size_t record_bytes,
                                 std::size_t num_points) {
  // PCL complains on the console, which is not ours to write to.
  static const bool silenced = [] {
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
    return true;
  }();
  static_cast<void>(silenced);

  pcl::PCLPointCloud2 cloud = MakeCloud(fields, record_bytes, num_points);
  const std::size_t num_bytes = cloud.data.size();
  try {
    const auto* data = static_cast<const unsigned char*>(static_cast<const void*>(body.data()));
    pcl::PCDReader reader;
    if (reader.readBodyBinary(data, cloud, pcl::PCDReader::PCD_V7, compressed, 0) != 0 ||
        cloud.data.size() != num_bytes) {
      return absl::InvalidArgumentError("the compressed points are damaged");
    }
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat("PCL cannot read it: ", error.what()));
  }
  const auto* decoded = static_cast<const char*>(static_cast<const void*>(cloud.data.data()));
  return ReadRecords(MakeRecordLayout(fields, record_bytes), num_points, {decoded, num_bytes});
}

absl::StatusOr<Scan> DecodeBinary(const PcdHeader& header, std::string_view body) {
  const std::size_t num_bytes = header.num_points * header.record_bytes;
  if (body.size() < num_bytes) {
    return absl::InvalidArgumentError(absl::StrCat(
        "truncated: ", header.num_points, " points of ", header.record_bytes, " bytes need ",
        num_bytes, " bytes, but only ", body.size(), " follow the header"));
  }
  // Of the whole records, PCL need not look at any field but these.
  const std::vector<PcdField> xyz = {FindField(header.fields, "x"), FindField(header.fields, "y"),
                                     FindField(header.fields, "z")};
  return ReadWithPcl(body, false, xyz, header.record_bytes, header.num_points);
}

absl::StatusOr<Scan> DecodeCompressed(const PcdHeader& header, std::string_view body) {
  // Padding is not stored when compressed; PCL writes beyond its buffer if it is told of any.
  std::vector<PcdField> fields;
  std::size_t record_bytes = 0;
  for (PcdField field : header.fields) {
    if (field.name == "_") continue;
    field.offset = record_bytes;
    record_bytes += static_cast<std::size_t>(field.size) * field.count;
    fields.push_back(field);
  }
  if (body.size() <= kCompressedPrefixBytes) {
    return absl::InvalidArgumentError(absl::StrCat(
        "truncated: only ", body.size(), " bytes follow the header of a binary_compressed file"));
  }
  std::uint32_t compressed_bytes = 0;
  std::uint32_t num_bytes = 0;
  std::memcpy(&compressed_bytes, body.data(), sizeof(compressed_bytes));
  std::memcpy(&num_bytes, body.data() + sizeof(compressed_bytes), sizeof(num_bytes));
  if (compressed_bytes == 0 || compressed_bytes > body.size() - kCompressedPrefixBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("truncated: announces ", compressed_bytes, " compressed bytes, but ",
                     body.size() - kCompressedPrefixBytes, " follow"));
  }
  if (num_bytes != header.num_points * record_bytes ||
      num_bytes > kMaxLzfRatio * compressed_bytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("announces ", num_bytes, " bytes made of ", compressed_bytes,
                     " compressed ones, but ", header.num_points, " points of ", record_bytes,
                     " bytes need ", header.num_points * record_bytes));
  }
  return ReadWithPcl(body, true, fields, record_bytes, header.num_points);
}

// Not through PCL: it reads "abc" as 0 and takes many times as long.
absl::StatusOr<Scan> DecodeAscii(const PcdHeader& header, std::string_view body) {
  const RowLayout layout{
      .num_columns = header.num_columns,
      .xyz = {FindField(header.fields, "x").column, FindField(header.fields, "y").column,
              FindField(header.fields, "z").column}};
  LineReader lines(body, header.num_lines + 1);
  absl::StatusOr<Scan> scan = ReadTextRows(layout, header.num_points, lines);
  if (!scan.ok()) return scan;
  std::vector<std::string_view> tokens;
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

absl::StatusOr<Scan> DecodePcd(std::string_view bytes) {
  const absl::StatusOr<PcdHeader> header = ParsePcdHeader(bytes);
  if (!header.ok()) return header.status();
  if (header->num_points == 0) return Scan();
  const std::string_view body = bytes.substr(header->body_offset);
  switch (header->data) {
    case PcdHeader::Data::kAscii:
      return DecodeAscii(*header, body);
    case PcdHeader::Data::kBinary:
      return DecodeBinary(*header, body);
    case PcdHeader::Data::kBinaryCompressed:
      return DecodeCompressed(*header, body);
  }
  return absl::InternalError("unknown kind of PCD data");
}

}  // namespace scanloc::dataset
