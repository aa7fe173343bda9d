#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "scan_decoders.hpp"
#include "scanloc/core/limits.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr std::uint64_t kMaxHeaderBytes = 64 << 10;
constexpr std::uint64_t kMaxColumns = 1024;
constexpr std::string_view kBlanks = " \t\n";

absl::Status Bad(std::string_view reason) {
  return absl::InvalidArgumentError(absl::StrCat("NPY: ", ToAbsl(reason)));
}

struct ValueType {
  std::string_view descr;
  NumberType type;
  std::uint64_t size_bytes;
};
constexpr std::array<ValueType, 4> kValueTypes = {{{"<i2", NumberType::kInt16, 2},
                                                   {"<i4", NumberType::kInt32, 4},
                                                   {"<f4", NumberType::kFloat32, 4},
                                                   {"<f8", NumberType::kFloat64, 8}}};

struct NpyHeader {
  std::string_view descr;
  bool fortran_order = false;
  std::uint64_t num_rows = 0;
  std::uint64_t num_columns = 0;
};

// Reads the header's text: the literal of a Python dictionary with three known entries.
class HeaderParser {
 public:
  explicit HeaderParser(std::string_view text) : rest_(text) {}

  absl::StatusOr<NpyHeader> Parse() {
    if (!Take('{')) return Bad("its header is no dictionary");
    while (!Take('}')) {
      const std::optional<std::string_view> key = TakeString();
      if (!key || !Take(':')) return Unreadable();
      if (absl::Status status = ParseValue(*key); !status.ok()) return status;
      if (Take(',')) continue;
      if (!Take('}')) return Unreadable();
      break;
    }
    if (!has_descr_ || !has_order_ || !has_shape_) {
      return Bad("its header lacks one of descr, fortran_order and shape");
    }
    if (rest_.find_first_not_of(kBlanks) != std::string_view::npos) return Unreadable();
    return header_;
  }

 private:
  [[nodiscard]] absl::Status Unreadable() const {
    return Bad(absl::StrCat("its header is malformed before ", Quote(rest_)));
  }

  void SkipBlanks() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(kBlanks), rest_.size()));
  }

  bool Take(char c) {
    SkipBlanks();
    if (rest_.empty() || rest_.front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }

  std::optional<std::string_view> TakeString() {
    SkipBlanks();
    if (rest_.empty() || (rest_.front() != '\'' && rest_.front() != '"')) return std::nullopt;
    const std::size_t end = rest_.find(rest_.front(), 1);
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view text = rest_.substr(1, end - 1);
    rest_.remove_prefix(end + 1);
    return text;
  }

  // What stands before the next of `ends`.
  std::string_view TakeUntil(std::string_view ends) {
    SkipBlanks();
    const std::string_view token = rest_.substr(0, rest_.find_first_of(ends));
    rest_.remove_prefix(token.size());
    return token.substr(0, token.find_last_not_of(kBlanks) + 1);
  }

  absl::Status ParseValue(std::string_view key) {
    if (key == "descr" && !has_descr_) return ParseDescr();
    if (key == "fortran_order" && !has_order_) return ParseOrder();
    if (key == "shape" && !has_shape_) return ParseShape();
    return Bad(absl::StrCat("its header has an entry ", Quote(key), " too many"));
  }

  absl::Status ParseDescr() {
    const std::optional<std::string_view> descr = TakeString();
    if (!descr) return Bad("its values are records; a plain array of numbers is needed");
    header_.descr = *descr;
    has_descr_ = true;
    return absl::OkStatus();
  }

  absl::Status ParseOrder() {
    const std::string_view word = TakeUntil(",}");
    if (word != "True" && word != "False") {
      return Bad(absl::StrCat("its fortran_order is ", Quote(word), ", not True or False"));
    }
    header_.fortran_order = word == "True";
    has_order_ = true;
    return absl::OkStatus();
  }

  absl::Status ParseShape() {
    if (!Take('(')) return Bad("its shape is not in brackets");
    std::array<std::uint64_t, 2> shape{};
    std::size_t num_dimensions = 0;
    while (!Take(')')) {
      const std::string_view word = TakeUntil(",)");
      std::uint64_t value = 0;
      if (!absl::SimpleAtoi(ToAbsl(word), &value)) {
        return Bad(absl::StrCat("its shape holds ", Quote(word), ", which is no length"));
      }
      if (num_dimensions < shape.size()) shape[num_dimensions] = value;
      ++num_dimensions;
      if (!Take(',') && (rest_.empty() || rest_.front() != ')')) return Unreadable();
    }
    if (num_dimensions != shape.size()) {
      return Bad(absl::StrCat("it has ", num_dimensions,
                              " dimensions; a scan has two, points by coordinates"));
    }
    header_.num_rows = shape[0];
    header_.num_columns = shape[1];
    has_shape_ = true;
    return absl::OkStatus();
  }

  std::string_view rest_;
  NpyHeader header_;
  bool has_descr_ = false;
  bool has_order_ = false;
  bool has_shape_ = false;
};

std::uint64_t LittleEndian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i > 0; --i) {
    value = value << 8U | static_cast<unsigned char>(bytes[i - 1]);
  }
  return value;
}

// The header's text; the values follow it in `bytes`.
absl::StatusOr<std::string_view> TakeHeader(std::string_view& bytes) {
  constexpr std::size_t kVersionBytes = 2;
  if (bytes.substr(0, kMagic.size()) != kMagic) return Bad("it does not begin as a NumPy array");
  bytes.remove_prefix(kMagic.size());
  if (bytes.size() < kVersionBytes) return Bad("truncated in its version");
  const auto version = static_cast<unsigned char>(bytes[0]);
  if (version < 1 || version > 3) {
    return Bad(absl::StrCat("its version is ", version, "; 1, 2 and 3 are read"));
  }
  bytes.remove_prefix(kVersionBytes);
  const std::size_t length_bytes = version == 1 ? 2 : 4;
  if (bytes.size() < length_bytes) return Bad("truncated in the length of its header");
  const std::uint64_t header_bytes = LittleEndian(bytes.substr(0, length_bytes));
  bytes.remove_prefix(length_bytes);
  if (header_bytes > kMaxHeaderBytes) {
    return Bad(absl::StrCat("its header has ", header_bytes, " bytes; at most ", kMaxHeaderBytes,
                            " are read"));
  }
  if (header_bytes > bytes.size()) return Bad("truncated in its header");
  const std::string_view header = bytes.substr(0, header_bytes);
  bytes.remove_prefix(header_bytes);
  return header;
}

absl::StatusOr<ValueType> FindType(std::string_view descr) {
  for (const ValueType& type : kValueTypes) {
    if (type.descr == descr) return type;
  }
  return Bad(
      absl::StrCat("its values are of type ", Quote(descr), "; <i2, <i4, <f4 and <f8 are read"));
}

absl::Status CheckShape(const NpyHeader& header, const ValueType& type, std::size_t num_bytes) {
  if (header.num_columns < 3 || header.num_columns > kMaxColumns) {
    return Bad(absl::StrCat("it has ", header.num_columns, " columns; x, y and z are needed, and ",
                            kMaxColumns, " at most"));
  }
  if (header.num_rows > limits::kMaxPointsPerScan) {
    return Bad(absl::StrCat("it holds ", header.num_rows, " points; a scan has at most ",
                            limits::kMaxPointsPerScan));
  }
  const std::uint64_t needed_bytes = header.num_rows * header.num_columns * type.size_bytes;
  if (needed_bytes > num_bytes) {
    return Bad(absl::StrCat("truncated: its shape needs ", needed_bytes, " bytes of values, but ",
                            num_bytes, " follow the header"));
  }
  return absl::OkStatus();
}

BinaryLayout LayoutOf(const NpyHeader& header, const ValueType& type) {
  const std::size_t size = type.size_bytes;
  BinaryLayout layout;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    layout.xyz[axis] = header.fortran_order
                           ? Coordinate{header.num_rows * axis * size, size, type.type}
                           : Coordinate{axis * size, header.num_columns * size, type.type};
  }
  return layout;
}

// Metres taken for centimetres put all points next to the sensor.
absl::Status CheckCentimetres(const Scan& scan) {
  constexpr float kNear_m = 1.0F;
  const auto num_near = static_cast<std::size_t>(
      std::count_if(scan.points.begin(), scan.points.end(),
                    [](const Point& p) { return std::hypot(p.x, p.y, p.z) < kNear_m; }));
  if (num_near <= scan.points.size() / 2) return absl::OkStatus();
  return Bad(absl::StrCat(num_near, " of its ", scan.points.size(), " points lie within ", kNear_m,
                          " m of the sensor: .npy scans are read as NAVER LABS's, in centimetres, "
                          "and this one seems to be in metres"));
}

}  // namespace

absl::StatusOr<Scan> DecodeNpy(std::string_view bytes) {
  const absl::StatusOr<std::string_view> text = TakeHeader(bytes);
  if (!text.ok()) return text.status();
  const absl::StatusOr<NpyHeader> header = HeaderParser(*text).Parse();
  if (!header.ok()) return header.status();
  const absl::StatusOr<ValueType> type = FindType(header->descr);
  if (!type.ok()) return type.status();
  if (absl::Status status = CheckShape(*header, *type, bytes.size()); !status.ok()) return status;
  Scan scan = ReadBinary(LayoutOf(*header, *type), header->num_rows, bytes);
  scan.num_no_return = static_cast<std::size_t>(std::erase(scan.points, Point{}));
  constexpr float kCmPerM = 100.0F;
  for (Point& p : scan.points) p = {p.x / kCmPerM, p.y / kCmPerM, p.z / kCmPerM};
  if (absl::Status status = CheckCentimetres(scan); !status.ok()) return status;
  return scan;
}

}  // namespace scanloc::dataset
