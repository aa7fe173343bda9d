#include "npy_header.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/byte_order.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::string_view kNpyMagic = "\x93NUMPY";
constexpr std::uint64_t kMaxHeaderBytes = 64 << 10;
constexpr std::string_view kHeaderBlanks = " \t\n";

struct ValueType {
  std::string_view descr;
  NumberType type;
  std::uint64_t size_bytes;
};
constexpr std::array<ValueType, 4> kValueTypes = {{{"<i2", NumberType::kInt16, 2},
                                                   {"<i4", NumberType::kInt32, 4},
                                                   {"<f4", NumberType::kFloat32, 4},
                                                   {"<f8", NumberType::kFloat64, 8}}};

absl::StatusOr<ValueType> FindType(std::string_view descr) {
  for (const ValueType& type : kValueTypes) {
    if (type.descr == descr) return type;
  }
  return BadNpy(
      absl::StrCat("its values are of type ", Quote(descr), "; <i2, <i4, <f4 and <f8 are read"));
}

// Reads the header's text: the literal of a Python dictionary with three known entries.
class HeaderParser {
 public:
  explicit HeaderParser(std::string_view text) : rest_(text) {}

  absl::StatusOr<NpyHeader> Parse() {
    if (!Take('{')) return BadNpy("its header is no dictionary");
    while (!Take('}')) {
      const std::optional<std::string_view> key = TakeString();
      if (!key || !Take(':')) return Unreadable();
      RETURN_IF_ERROR(ParseValue(*key));
      if (Take(',')) continue;
      if (!Take('}')) return Unreadable();
      break;
    }
    if (!has_descr_ || !has_order_ || !has_shape_) {
      return BadNpy("its header lacks one of descr, fortran_order and shape");
    }
    if (rest_.find_first_not_of(kHeaderBlanks) != std::string_view::npos) return Unreadable();
    return header_;
  }

 private:
  [[nodiscard]] absl::Status Unreadable() const {
    return BadNpy(absl::StrCat("its header is malformed before ", Quote(rest_)));
  }

  void SkipBlanks() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(kHeaderBlanks), rest_.size()));
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
    return token.substr(0, token.find_last_not_of(kHeaderBlanks) + 1);
  }

  absl::Status ParseValue(std::string_view key) {
    if (key == "descr" && !has_descr_) return ParseDescr();
    if (key == "fortran_order" && !has_order_) return ParseOrder();
    if (key == "shape" && !has_shape_) return ParseShape();
    return BadNpy(absl::StrCat("its header has an entry ", Quote(key), " too many"));
  }

  absl::Status ParseDescr() {
    const std::optional<std::string_view> descr = TakeString();
    if (!descr) return BadNpy("its values are records; a plain array of numbers is needed");
    ASSIGN_OR_RETURN(const ValueType type, FindType(*descr));
    header_.type = type.type;
    header_.value_bytes = type.size_bytes;
    has_descr_ = true;
    return absl::OkStatus();
  }

  absl::Status ParseOrder() {
    const std::string_view word = TakeUntil(",}");
    if (word != "True" && word != "False") {
      return BadNpy(absl::StrCat("its fortran_order is ", Quote(word), ", not True or False"));
    }
    header_.fortran_order = word == "True";
    has_order_ = true;
    return absl::OkStatus();
  }

  absl::Status ParseShape() {
    if (!Take('(')) return BadNpy("its shape is not in brackets");
    std::array<std::uint64_t, 2> shape{};
    std::size_t num_dimensions = 0;
    while (!Take(')')) {
      const std::string_view word = TakeUntil(",)");
      std::uint64_t value = 0;
      if (!absl::SimpleAtoi(ToAbsl(word), &value)) {
        return BadNpy(absl::StrCat("its shape holds ", Quote(word), ", which is no length"));
      }
      if (num_dimensions < shape.size()) shape[num_dimensions] = value;
      ++num_dimensions;
      if (!Take(',') && (rest_.empty() || rest_.front() != ')')) return Unreadable();
    }
    if (num_dimensions != shape.size()) {
      return BadNpy(
          absl::StrCat("it has ", num_dimensions, " dimensions; two are needed, rows by columns"));
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

// The header's text; the values follow it in `bytes`.
absl::StatusOr<std::string_view> TakeHeader(std::string_view& bytes) {
  constexpr std::size_t kVersionBytes = 2;
  if (bytes.substr(0, kNpyMagic.size()) != kNpyMagic)
    return BadNpy("it does not begin as a NumPy array");
  bytes.remove_prefix(kNpyMagic.size());
  if (bytes.size() < kVersionBytes) return BadNpy("truncated in its version");
  const auto version = static_cast<unsigned char>(bytes[0]);
  if (version < 1 || version > 3) {
    return BadNpy(absl::StrCat("its version is ", version, "; 1, 2 and 3 are read"));
  }
  bytes.remove_prefix(kVersionBytes);
  const std::size_t length_bytes = version == 1 ? 2 : 4;
  if (bytes.size() < length_bytes) return BadNpy("truncated in the length of its header");
  const std::uint64_t header_bytes = version == 1 ? LoadNumber<std::uint16_t>(bytes.data())
                                                  : LoadNumber<std::uint32_t>(bytes.data());
  bytes.remove_prefix(length_bytes);
  if (header_bytes > kMaxHeaderBytes) {
    return BadNpy(absl::StrCat("its header has ", header_bytes, " bytes; at most ", kMaxHeaderBytes,
                               " are read"));
  }
  if (header_bytes > bytes.size()) return BadNpy("truncated in its header");
  const std::string_view header = bytes.substr(0, header_bytes);
  bytes.remove_prefix(header_bytes);
  return header;
}

}  // namespace

absl::Status BadNpy(std::string_view reason) {
  return absl::InvalidArgumentError(absl::StrCat("NPY: ", ToAbsl(reason)));
}

absl::StatusOr<NpyHeader> TakeNpyHeader(std::string_view& bytes) {
  ASSIGN_OR_RETURN(const std::string_view text, TakeHeader(bytes));
  return HeaderParser(text).Parse();
}

absl::Status CheckNpySize(const NpyHeader& header, std::size_t num_bytes) {
  const std::uint64_t needed_bytes = header.num_rows * header.num_columns * header.value_bytes;
  if (needed_bytes <= num_bytes) return absl::OkStatus();
  return BadNpy(absl::StrCat("truncated: its shape needs ", needed_bytes, " bytes of values, but ",
                             num_bytes, " follow the header"));
}

}  // namespace scanloc::dataset
