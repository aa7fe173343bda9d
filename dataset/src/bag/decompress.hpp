#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "absl/status/statusor.h"
#include "bag/spare_memory.hpp"
#include "file_bytes.hpp"

namespace scanloc::dataset {

/// What a zstd frame begins with.
inline constexpr std::string_view kZstdMagic = "\x28\xB5\x2F\xFD";

enum class Compression { kNone, kZstd, kLz4, kBz2 };

/// "" and "none", "zstd", "lz4" and "bz2".
[[nodiscard]] std::optional<Compression> ParseCompression(std::string_view name);

/// What to do where fewer bytes come out than asked for.
enum class CutOff {
  kRefuse,
  kAnySize,       ///< take what came, if the compressed bytes are whole
  kKeepWhatCame,  ///< even if they are not
};

/// The num_bytes bytes that were compressed; zstd and LZ4 in their frame formats.
///
/// DataLoss if they are damaged, or other than num_bytes come out (but for kRefuse: more);
/// ResourceExhausted if there is no memory for them. Memory is touched only as bytes come out, so
/// that an announced size costs nothing; bound it by limits::kMaxBagChunkBytes before. It is taken
/// from `memory`, if that is given.
[[nodiscard]] absl::StatusOr<FileBytes> Decompress(Compression compression, std::string_view bytes,
                                                   std::size_t num_bytes,
                                                   CutOff cut_off = CutOff::kRefuse,
                                                   SpareMemory* memory = nullptr);

/// The bytes of one zstd frame that tells its size, or streams. InvalidArgument if it announces
/// more than max_bytes, DataLoss if more come out.
[[nodiscard]] absl::StatusOr<FileBytes> DecompressZstd(std::string_view bytes,
                                                       std::size_t max_bytes);

}  // namespace scanloc::dataset
