#pragma once

#include <cstdint>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scan_decoders.hpp"

/// How a NumPy array begins.
namespace scanloc::dataset {

struct NpyHeader {
  NumberType type = NumberType::kFloat32;
  std::uint64_t value_bytes = 0;  ///< of one value
  bool fortran_order = false;
  std::uint64_t num_rows = 0;
  std::uint64_t num_columns = 0;
};

/// Takes the header off `bytes`, which then begin with the values, little endian: they may be too
/// few. InvalidArgument: no array of two dimensions of <i2, <i4, <f4 or <f8.
[[nodiscard]] absl::StatusOr<NpyHeader> TakeNpyHeader(std::string_view& bytes);

/// InvalidArgument, with "NPY: " before the reason.
[[nodiscard]] absl::Status BadNpy(std::string_view reason);

/// InvalidArgument unless so many bytes hold all values. Requires that their number does not
/// overflow.
[[nodiscard]] absl::Status CheckNpySize(const NpyHeader& header, std::size_t num_bytes);

}  // namespace scanloc::dataset
